// The value whose storing as 8 bits gives floor(255*v + 1/2), whatever way the device rounds.
vec3 quantized(vec3 color) {
    return floor(LEVELS * clamp(color, 0.0, 1.0) + 0.5) / LEVELS;
}
