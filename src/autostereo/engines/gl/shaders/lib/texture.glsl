// Trilinear textures whose level is chosen by exact derivatives (engines/reference/texture.py).

uniform sampler2D image;

// Colour at texture coordinates that change by (dx, dy) per pixel to the right and down. Levels are blended here, as
// drivers save on that.
vec3 trilinear(vec2 uv, vec2 dx, vec2 dy) {
    vec2 size = vec2(textureSize(image, 0));
    float top = floor(log2(max(size.x, size.y)) + 0.01);
    dx *= size;
    dy *= size;
    float level = clamp(0.5 * log2(max(max(dot(dx, dx), dot(dy, dy)), 1.0)), 0.0, top);
    float fine = floor(level);
    return mix(textureLod(image, uv, fine).rgb, textureLod(image, uv, min(fine + 1.0, top)).rgb, level - fine);
}
