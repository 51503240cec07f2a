// The centre camera and the scene's depths: the same in every view. Eye space: X right, Y up, d > 0 in front.
// Filled by blocks.py. DESIGN section 1.

layout(std140) uniform Frame {
    mat4 eye_from_local;   // local: world, moved so that the scene's middle is the origin
    vec4 lens;             // fx, fy in pixels; focal distance; offset_y
    vec4 window;           // width, height in pixels; where the centre camera looks, x and y
    vec4 depth_range;      // 1/nearest; 1/nearest - 1/farthest; near plane; 1/focal distance
};

// Depth buffers hold (1/nearest - 1/d)/(1/nearest - 1/farthest): affine in the picture, 0 in front, 1 behind.
float window_from_depth(float d) {
    return (depth_range.x - 1.0 / d) / depth_range.y;
}

float depth_from_window(float z) {
    return 1.0 / (depth_range.x - z * depth_range.y);
}

// Picture position times depth, rows from the top, of an eye-space point seen from camera offset v.
vec2 picture_times_depth(vec3 eye, float v) {
    return window.zw * eye.z + vec2(lens.x * (eye.x - v + v * depth_range.w * eye.z),
                                    -lens.y * (eye.y - lens.w + lens.w * depth_range.w * eye.z));
}

// The ray of camera offset v through a picture position starts at (v, lens.w, 0) and gains this per unit of depth.
vec3 ray_direction(vec2 picture, float v) {
    vec2 slope = (picture - window.zw) / lens.xy;
    return vec3(slope.x - v * depth_range.w, -slope.y - lens.w * depth_range.w, 1.0);
}
