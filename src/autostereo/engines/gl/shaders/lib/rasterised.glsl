// Textures of triangles that the device rasterises. Needs texture.glsl.

// Colour at a rasterised sample. Texture coordinates over depth, and 1/depth, are affine in the picture: their differences
// within a quad of pixels are their derivatives whatever the quad, and the quotient rule gives those of the coordinates.
vec3 rasterised(vec2 uv, float inverse_depth) {
    vec2 s = uv * inverse_depth;
    return trilinear(uv, (dFdx(s) - uv * dFdx(inverse_depth)) / inverse_depth,
                     (dFdy(s) - uv * dFdy(inverse_depth)) / inverse_depth);
}
