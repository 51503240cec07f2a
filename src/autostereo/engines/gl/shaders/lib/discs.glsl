// Where rays meet surfels: lib/surfels.glsl says how. Needs frame.glsl and surfels.glsl.
// What is known of the disc comes from the vertices; a compute shader, which fills it itself, defines GIVEN as nothing.

#ifndef GIVEN
#define GIVEN flat in
#endif
GIVEN vec4 place;
GIVEN vec4 normal;
GIVEN vec4 shape;
GIVEN vec4 area;
GIVEN vec3 color;
#ifdef SIDES
GIVEN vec3 back;
#endif

// The depth at which rays from camera offsets v meet the disc; a ray gains (dx, dy, 1) per unit of depth. Returns its
// weight there, <= 0 outside.
real meet(real v, real dx, float dy, out real depth) {
    vec3 p = place.xyz, n = normal.xyz;
    float y = p.y - lens.w;
    real x = p.x - v;
    real a = x / p.z;
    real squares = shape.x + a * (shape.y + a * shape.z), areas = area.x + a * area.y;
    real wide = step(real(0.5), squares) * step(real(0.0), areas * areas - 0.25 * squares + 0.0625);

    // upright: depth d, and half axes of their own
    real across = chosen(real(1.0), n.x * dx + (n.y * dy + n.z), wide);
    across += TINY * step(abs(across), real(0.0));
    depth = clamp(chosen(real(p.z), n.x * x + (n.y * y + n.z * p.z), wide) / across, -FAR, FAR);
    real away_x = depth * dx - x, away_y = depth * dy - y, away_z = depth - p.z;
    vec2 half_axes = max(vec2(place.w), LEAST_RADIUS * p.z / lens.xy);
    return 1.0 - away_x * away_x * chosen(real(1.0 / (half_axes.x * half_axes.x)), real(shape.w), wide)
        - away_y * away_y * chosen(real(1.0 / (half_axes.y * half_axes.y)), real(shape.w), wide)
        - away_z * away_z * shape.w;
}

// The light that eyes at camera offsets v get from the disc: for a panel, each channel by its own eye.
vec3 light_for(real v) {
    vec3 light = color;
#ifdef SIDES
    real side = side_seen(v, place.xyz, normal.xyz);
    light = chosen(back, color, side);
#ifdef OWN_EYE
    light += highlights(v, side, place.xyz, normal.xyz, area.zw);
#endif
#endif
    return light;
}

#ifdef THREE_RAYS
uniform vec3 columns;       // where pixels are sampled
uniform float row;
uniform vec4 sheet;         // size of the band; its first row; columns of groups

// The rays of the sub-pixels of a pixel of the band, from their cameras at offsets v.
void rays_of(ivec2 at, vec3 v, out vec3 dx, out float dy) {
    vec2 pixel = vec2(at) + vec2(0.0, sheet.z);
    dx = (pixel.x + columns - window.z) / lens.x - v * depth_range.w;
    dy = -(pixel.y + row - window.w) / lens.y - lens.w * depth_range.w;
}
#endif
