// Light on volumes: Blinn-Phong on gradients (engines/reference/volume.py). Needs frame.glsl, shading.glsl.
// Switches: LIGHTS; SHINY: there is a highlight; PLACED: lighting depends on the place.

uniform mat3 normal_from_gradient[VOLUMES];  // eye space
uniform vec4 volume_material[VOLUMES];       // ambient, diffuse, specular, shininess

// What multiplies the own colour at a point, and what is added: both sides are lit, |N.L| and |N.H|. Where there is no
// gradient the colour stays as it is.
void light_inside(int v, vec3 gradient, vec3 point, vec3 eye, out vec3 reflected, out vec3 highlight) {
    vec4 m = volume_material[v];
    bool plain = dot(gradient, gradient) < FLAT;
    reflected = vec3(plain ? 1.0 : m.x);
    highlight = vec3(0.0);
#if LIGHTS > 0
    vec3 normal = normal_from_gradient[v] * gradient;
    normal *= plain ? 0.0 : inversesqrt(dot(normal, normal));
#ifdef SHINY
    vec3 view = eye - point;
    view *= inversesqrt(dot(view, view));
#endif
    for (int k = 0; k < LIGHTS; ++k) {
        vec3 towards = light_place[k].xyz;   // directions are unit vectors
#ifdef PLACED
        if (light_place[k].w != 0.0) {
            towards = unit(towards - point);
        }
#endif
        reflected += m.y * abs(dot(normal, towards)) * light_color[k];
#ifdef SHINY
        // (N.H)^n, H = unit(half_way), as a power of its square: one root less
        vec3 half_way = towards + view;
        float along_normal = dot(normal, half_way);
        float squared = along_normal * along_normal / max(dot(half_way, half_way), TINY);
        float gloss = m.w == 0.0 ? 1.0 : exp2(0.5 * m.w * log2(max(squared, TINY)));
        highlight += (plain ? 0.0 : m.z * gloss) * light_color[k];
#endif
    }
#endif
}
