// Light on volumes: Blinn-Phong on gradients (engines/reference/volume.py). Needs frame.glsl, shading.glsl.

uniform mat3 normal_from_gradient[VOLUMES];  // eye space
uniform vec4 volume_material[VOLUMES];       // ambient, diffuse, specular, shininess

// What multiplies the own colour at a point, and what is added: both sides are lit, |N.L| and |N.H|. Where there is no
// gradient the colour stays as it is.
void light_inside(int v, vec3 gradient, vec3 point, vec3 eye, out vec3 reflected, out vec3 highlight) {
    reflected = vec3(1.0);
    highlight = vec3(0.0);
    bool plain = dot(gradient, gradient) < FLAT;
    vec4 m = volume_material[v];
    vec3 normal = unit(normal_from_gradient[v] * gradient);
    reflected = vec3(m.x);
#if LIGHTS > 0
    for (int k = 0; k < LIGHTS; ++k) {
#ifdef PLACED
        vec3 towards = unit(light_place[k].xyz - light_place[k].w * point);
#else
        vec3 towards = light_place[k].xyz;  // directions are unit vectors
#endif
        float cosine = abs(dot(normal, towards));
        reflected += m.y * cosine * light_color[k];
#ifdef SHINY
        float gloss = abs(dot(normal, unit(towards + unit(eye - point))));
        highlight += m.z * (m.w == 0.0 ? 1.0 : pow(gloss, m.w)) * light_color[k];
#endif
    }
#endif
    reflected = plain ? vec3(1.0) : reflected;
    highlight = plain ? vec3(0.0) : highlight;
}
