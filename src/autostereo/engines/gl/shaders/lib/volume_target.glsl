// Where a fragment of a volume lies: in the tile of a view, or on a panel, where its sub-pixels have eyes of their own.
// Needs frame.glsl, color.glsl, lanes.glsl, volume.glsl; views.glsl, or viewmap.glsl and cameras.glsl with the switch PANEL.
//
// Switches: OPAQUE: rays end at depths drawn before; COVERED: something was drawn before; SORTED (sorted.glsl).

#ifdef PANEL
uniform vec3 columns;          // where in a pixel the channels are sampled
uniform float sample_row;
uniform int channel;           // whose ray is followed, if it is one
#else
flat in vec3 view;             // camera offset; first column and row of the tile
#endif
#ifdef OPAQUE
uniform sampler2D depth_before;
#endif
#ifdef COVERED
uniform sampler2D color_before;
#else
uniform vec3 background;
#endif

LANE ray_length;               // per unit of depth
ivec2 pixel;
ivec3 order;                   // channel that a lane shows, if there are three

// 1 at the channel that a lane shows.
vec3 pick(int l) {
    int c = l == 0 ? order.x : l == 1 ? order.y : order.z;
    return vec3(equal(ivec3(c), ivec3(0, 1, 2)));
}

// What the lanes hold for their channels, or what one ray holds for all.
vec3 by_channel(vec3 lanes) {
#if LANES == 3
    return lanes.x * pick(0) + lanes.y * pick(1) + lanes.z * pick(2);
#else
    return lanes;
#endif
}

vec3 by_lane(vec3 channels) {
#if LANES == 3
    return vec3(dot(channels, pick(0)), dot(channels, pick(1)), dot(channels, pick(2)));
#else
    return channels;
#endif
}

void start_rays() {
    left = 1.0;
    twins = false;
    order = ivec3(0, 1, 2);
    pixel = ivec2(gl_FragCoord.xy);
#ifdef SORTED
    pixel.x = shown_at(pixel.x, int(window.x));
#endif
#ifdef PANEL
    ivec2 picture = mirrored(pixel, ivec2(window.xy));
    vec3 eyes = offsets_of_subpixels(pixel.x, pixel.y);
    vec2 place = vec2(picture) + vec2(0.0, sample_row);
#if LANES == 3
    vec3 gap = abs(eyes.xyz - eyes.yzx);
    order = gap.z <= min(gap.x, gap.y) ? ivec3(0, 1, 2) : gap.x <= gap.y ? ivec3(0, 2, 1) : ivec3(1, 0, 2);
    vec3 x;
    for (int c = 0; c < 3; ++c) {
        vec3 ray = ray_direction(place + vec2(columns[c], 0.0), eyes[c]);
        x[c] = ray.x;
        turn_y = ray.y;
    }
    origin_x = by_lane(eyes);
    turn_x = by_lane(x);
    twins = origin_x.x == origin_x.z && turn_x.x == turn_x.z;
#else
    vec3 ray = ray_direction(place + vec2(columns[channel], 0.0), eyes[channel]);
    origin_x = eyes[channel];
#endif
#else
    vec3 ray = ray_direction(gl_FragCoord.xy - view.yz, view.x);
    origin_x = view.x;
#endif
#if LANES == 1
    turn_x = ray.x;
    turn_y = ray.y;
#endif
    ray_length = sqrt(1.0 + turn_y * turn_y + turn_x * turn_x);
    stop = LANE(1e30);
#ifdef OPAQUE
    vec4 z = texelFetch(depth_before, pixel, 0);
#if LANES == 3
    z.rgb = by_lane(z.rgb);
    vec3 depth = 1.0 / (depth_range.x - z.rgb * depth_range.y);
    stop = mix(vec3(1e30), depth, lessThan(z.rgb, vec3(1.0)));
#else
#ifdef PANEL
    z.r = z[channel];
#endif
    stop = z.r < 1.0 ? depth_from_window(z.r) : 1e30;
#endif
#endif
}

// What was there before, opacity last.
vec4 before() {
#ifdef COVERED
    return texelFetch(color_before, pixel, 0);
#else
    return vec4(background, 0.0);
#endif
}

// Light that is premultiplied over what was there before.
vec4 over(vec3 light, vec3 through) {
    vec4 behind = before();
    return vec4(quantized(light + through * behind.rgb), 1.0 - through.x * (1.0 - behind.a));
}
