// A part's vertices in eye space, as the plane rasteriser keeps them between its first and last stage. Needs surface.glsl,
// plane_memory.glsl.

layout(rgba32f, binding = 7) uniform image2D surfaces;  // SURFACE_TEXELS texels each

const uint SURFACE_TEXELS = 4u;

void store_surface(uint k, Surface s) {
    vec4 texel[4] = vec4[4](vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
#ifdef VERTEX_LIGHTING
    texel[0].xyz = s.front;
#ifdef TWO_SIDED
    texel[1].xyz = s.back;
#endif
#ifdef SHINY
    texel[2].xyz = s.front_highlight;
#ifdef TWO_SIDED
    texel[3].xyz = s.back_highlight;
#endif
#endif
#else
    texel[0].xyz = s.color;
    texel[1].xyz = s.normal;
#endif
#ifdef TEXTURED
    texel[0].w = s.uv.x;
    texel[1].w = s.uv.y;
#endif
    for (uint i = 0u; i < SURFACE_TEXELS; ++i) {
        imageStore(surfaces, place_of(SURFACE_TEXELS * k + i), texel[i]);
    }
}

Surface load_surface(uint k) {
    Surface s;
    vec4 first = imageLoad(surfaces, place_of(SURFACE_TEXELS * k));
#if !defined(VERTEX_LIGHTING) || defined(TWO_SIDED) || defined(TEXTURED)
    vec4 second = imageLoad(surfaces, place_of(SURFACE_TEXELS * k + 1u));
#endif
#ifdef VERTEX_LIGHTING
    s.front = first.xyz;
#ifdef TWO_SIDED
    s.back = second.xyz;
#endif
#ifdef SHINY
    s.front_highlight = imageLoad(surfaces, place_of(SURFACE_TEXELS * k + 2u)).xyz;
#ifdef TWO_SIDED
    s.back_highlight = imageLoad(surfaces, place_of(SURFACE_TEXELS * k + 3u)).xyz;
#endif
#endif
#else
    s.color = first.xyz;
    s.normal = second.xyz;
#ifdef PLACED
    s.point = vec3(0.0);  // mixed() is given the sample's own
#endif
#endif
#ifdef TEXTURED
    s.uv = vec2(first.w, second.w);
#endif
    return s;
}
