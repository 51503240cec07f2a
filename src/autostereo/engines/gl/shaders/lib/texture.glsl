// Trilinear textures whose level is chosen by exact derivatives (engines/reference/texture.py).
//
// Texture coordinates over depth, and 1/depth, are affine in the picture: their differences within a quad of pixels are
// their derivatives whatever the quad, and the quotient rule gives those of the coordinates at the very sample.
// Levels are blended here, as drivers save on that.

uniform sampler2D image;

vec4 textured(vec2 uv, float inverse_depth) {
    vec2 s = uv * inverse_depth;
    vec2 size = vec2(textureSize(image, 0));
    vec2 dx = (dFdx(s) - uv * dFdx(inverse_depth)) / inverse_depth * size;
    vec2 dy = (dFdy(s) - uv * dFdy(inverse_depth)) / inverse_depth * size;
    float top = floor(log2(max(size.x, size.y)) + 0.01);
    float level = clamp(0.5 * log2(max(max(dot(dx, dx), dot(dy, dy)), 1.0)), 0.0, top);
    float fine = floor(level);
    return mix(textureLod(image, uv, fine), textureLod(image, uv, min(fine + 1.0, top)), level - fine);
}
