// Pixels at which a surfel may be seen by cameras between the ends of `reach`, first and past the last, within `bounds`
// (left, top, right, bottom); Huebner 2007b, section 3.2, DESIGN erratum 2. Needs frame.glsl.

uniform vec4 sample_range;  // least and greatest position, in x and in y, at which pixels are sampled

void find_quad(vec3 place, vec4 box, vec2 reach, vec4 bounds, out vec2 low, out vec2 high) {
    float nearness = 1.0 / place.z;
    vec2 x = window.z + lens.x * ((place.x - reach) * nearness + reach * depth_range.w);  // picture_times_depth
    float y = window.w - lens.y * ((place.y - lens.w) * nearness + lens.w * depth_range.w);
    low = max(ceil(vec2(min(x.x, x.y), y) + box.xz - sample_range.yw), bounds.xy);
    high = min(floor(vec2(max(x.x, x.y), y) + box.yw - sample_range.xz) + 1.0, bounds.zw);
    if (box.x > box.y || !(low.x < high.x && low.y < high.y)) {
        low = high = vec2(0.0);
    }
}
