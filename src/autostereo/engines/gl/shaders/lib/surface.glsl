// What a mesh's vertices hand on to its samples, and how samples are coloured (engines/reference/shading.py).
// Needs frame.glsl, shading.glsl and, in the stage that colours, color.glsl and texture.glsl.
//
// Switches: VERTEX_LIGHTING, else every sample is lit; CENTER_EYE: for the centre camera's eye; TEXTURED; TWO_SIDED;
// SHINY: there is a highlight; PLACED: lighting depends on the place. Only what they need travels: stages pay for each
// number (de Sorbier 2008, section 5).

struct Surface {
#ifdef VERTEX_LIGHTING
    vec3 front;
#ifdef TWO_SIDED
    vec3 back;
#endif
#ifdef SHINY
    vec3 front_highlight;
#ifdef TWO_SIDED
    vec3 back_highlight;
#endif
#endif
#else
    vec3 color;
    vec3 normal;
#ifdef PLACED
    vec3 point;
#endif
#endif
#ifdef TEXTURED
    vec2 uv;
#endif
};

uniform vec4 material;  // ambient, diffuse, specular, shininess

// A vertex, in eye space.
Surface surface_at(vec3 point, vec3 normal, vec3 color, vec2 uv) {
    Surface s;
#ifdef VERTEX_LIGHTING
    vec3 reflected, highlight, eye = vec3(0.0, lens.w, 0.0);
    illuminate(point, normal, eye, material, reflected, highlight);
    s.front = color * reflected;
#ifdef SHINY
    s.front_highlight = highlight;
#endif
#ifdef TWO_SIDED
    illuminate(point, -normal, eye, material, reflected, highlight);
    s.back = color * reflected;
#ifdef SHINY
    s.back_highlight = highlight;
#endif
#endif
#else
    s.color = color;
    s.normal = normal;
#ifdef PLACED
    s.point = point;
#endif
#endif
#ifdef TEXTURED
    s.uv = uv;
#endif
    return s;
}

#ifdef COLORING
// The colour of a sample, for the camera at offset v; `paint` is the texture's colour, or white.
vec3 surface_color(Surface s, bool front, float v, vec3 paint) {
    vec3 color, highlight = vec3(0.0);
#ifdef VERTEX_LIGHTING
    color = s.front;
#ifdef SHINY
    highlight = s.front_highlight;
#endif
#ifdef TWO_SIDED
    if (!front) {
        color = s.back;
#ifdef SHINY
        highlight = s.back_highlight;
#endif
    }
#endif
#else
    vec3 normal = unit(s.normal);
#ifdef TWO_SIDED
    normal = front ? normal : -normal;
#endif
#ifdef PLACED
    vec3 point = s.point;
#else
    vec3 point = vec3(0.0);
#endif
#ifdef CENTER_EYE
    vec3 eye = vec3(0.0, lens.w, 0.0);
#else
    vec3 eye = vec3(v, lens.w, 0.0);
#endif
    vec3 reflected;
    illuminate(point, normal, eye, material, reflected, highlight);
    color = s.color * reflected;
#endif
    return color * paint + highlight;
}
#endif

#ifdef MIXING
// The surface at `point`, between three vertices of these weights.
Surface mixed(Surface at[3], vec3 w, vec3 point) {
    Surface s;
#ifdef VERTEX_LIGHTING
    s.front = w.x * at[0].front + w.y * at[1].front + w.z * at[2].front;
#ifdef TWO_SIDED
    s.back = w.x * at[0].back + w.y * at[1].back + w.z * at[2].back;
#endif
#ifdef SHINY
    s.front_highlight = w.x * at[0].front_highlight + w.y * at[1].front_highlight + w.z * at[2].front_highlight;
#ifdef TWO_SIDED
    s.back_highlight = w.x * at[0].back_highlight + w.y * at[1].back_highlight + w.z * at[2].back_highlight;
#endif
#endif
#else
    s.color = w.x * at[0].color + w.y * at[1].color + w.z * at[2].color;
    s.normal = w.x * at[0].normal + w.y * at[1].normal + w.z * at[2].normal;
#ifdef PLACED
    s.point = point;
#endif
#endif
#ifdef TEXTURED
    s.uv = w.x * at[0].uv + w.y * at[1].uv + w.z * at[2].uv;
#endif
    return s;
}

#ifdef TEXTURED
vec2 uv_of(Surface at[3], vec3 w) {
    return w.x * at[0].uv + w.y * at[1].uv + w.z * at[2].uv;
}
#endif
#endif
