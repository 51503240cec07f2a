// Pixels at which a surfel may be seen by cameras between the ends of `reach`, first and past the last, within `bounds`
// (left, top, right, bottom); Huebner 2007b, section 3.2, DESIGN erratum 2. Needs frame.glsl.

uniform vec4 sample_range;  // least and greatest position, in x and in y, at which pixels are sampled

void find_quad(vec3 place, vec4 box, vec2 reach, vec4 bounds, out vec2 low, out vec2 high) {
    vec2 left = picture_times_depth(place, reach.x) / place.z, right = picture_times_depth(place, reach.y) / place.z;
    low = max(ceil(min(left, right) + box.xz - sample_range.yw), bounds.xy);
    high = min(floor(max(left, right) + box.yw - sample_range.xz) + 1.0, bounds.zw);
    if (box.x > box.y || !(low.x < high.x && low.y < high.y)) {
        low = high = vec2(0.0);
    }
}
