// Linear interpolation in textures of one level, clamped to their edges.
// Switch: COARSE: the device interpolates with weights of a few bits, as GPUs do, so it is done here (filtering.py).

// Between the texels around a place, given in texels from the middle of the first.
vec4 interpolated(sampler3D voxels, vec3 place, vec3 size) {
#ifdef COARSE
    place = clamp(place, vec3(0.0), size - 1.0);
    ivec3 a = ivec3(place), b = min(a + 1, ivec3(size) - 1);
    vec3 part = place - vec3(a);
    vec4 rows[4];
    for (int k = 0; k < 4; ++k) {
        int y = (k & 1) == 0 ? a.y : b.y, z = (k & 2) == 0 ? a.z : b.z;
        rows[k] = mix(texelFetch(voxels, ivec3(a.x, y, z), 0), texelFetch(voxels, ivec3(b.x, y, z), 0), part.x);
    }
    return mix(mix(rows[0], rows[1], part.y), mix(rows[2], rows[3], part.y), part.z);
#else
    return textureLod(voxels, (place + 0.5) / size, 0.0);
#endif
}

// In a table, at 0 ... 1 from edge to edge.
vec4 looked_up(sampler2D table, vec2 place) {
#ifdef COARSE
    ivec2 last = textureSize(table, 0) - 1;
    place = clamp(place * vec2(last + 1) - 0.5, vec2(0.0), vec2(last));
    ivec2 a = ivec2(place), b = min(a + 1, last);
    vec2 part = place - vec2(a);
    return mix(mix(texelFetch(table, a, 0), texelFetch(table, ivec2(b.x, a.y), 0), part.x),
               mix(texelFetch(table, ivec2(a.x, b.y), 0), texelFetch(table, b, 0), part.x), part.y);
#else
    return textureLod(table, place, 0.0);
#endif
}
