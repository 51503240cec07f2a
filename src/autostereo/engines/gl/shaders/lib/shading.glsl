// Blinn-Phong in eye space (engines/reference/shading.py), not clamped. Switch: LIGHTS, their number.

#if LIGHTS > 0
uniform vec4 light_place[LIGHTS];  // w = 1: a position; w = 0: the direction towards the light
uniform vec3 light_color[LIGHTS];
#endif

vec3 unit(vec3 v) {
    return v / sqrt(max(dot(v, v), TINY));
}

// What multiplies the surface's own colour, and the highlight that is added.
// material: ambient, diffuse, specular, shininess. normal: unit, on the side that is seen.
void illuminate(vec3 point, vec3 normal, vec3 eye, vec4 material, out vec3 reflected, out vec3 highlight) {
    reflected = vec3(material.x);
    highlight = vec3(0.0);
#if LIGHTS > 0
    vec3 view = unit(eye - point);
    for (int k = 0; k < LIGHTS; ++k) {
        vec3 towards = unit(light_place[k].xyz - light_place[k].w * point);
        float cosine = dot(normal, towards);
        reflected += material.y * max(cosine, 0.0) * light_color[k];
        if (material.z > 0.0 && cosine > 0.0) {
            float gloss = max(dot(normal, unit(towards + view)), 0.0);
            highlight += material.z * (material.w == 0.0 ? 1.0 : pow(gloss, material.w)) * light_color[k];
        }
    }
#endif
}
