// Where a fragment of a volume lies: in the tile of a view, or on a panel, where its sub-pixels have eyes of their own.
// Needs frame.glsl, color.glsl, volume.glsl; views.glsl, or viewmap.glsl and cameras.glsl with the switch PANEL.
//
// Switches: OPAQUE: rays end at depths drawn before; COVERED: something was drawn before.

#ifdef PANEL
uniform vec3 columns;          // where in a pixel the channels are sampled
uniform float sample_row;
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

vec3 pick[LANES];              // the channels that a lane shows

void start_rays() {
#ifdef PANEL
    ivec2 at = ivec2(gl_FragCoord.xy), picture = mirrored(at, ivec2(window.xy));
    vec3 eyes = offsets_of_subpixels(at.x, at.y);
    vec2 place = vec2(picture) + vec2(0.0, sample_row);
#if LANES == 3
    // the two nearest eyes are lanes 0 and 2
    vec3 gap = abs(eyes.xyz - eyes.yzx);
    ivec3 order = gap.z <= min(gap.x, gap.y) ? ivec3(0, 1, 2) : gap.x <= gap.y ? ivec3(0, 2, 1) : ivec3(1, 0, 2);
    for (int l = 0; l < 3; ++l) {
        int c = order[l];
        pick[l] = vec3(equal(ivec3(c), ivec3(0, 1, 2)));
        vec3 ray = ray_direction(place + vec2(columns[c], 0.0), eyes[c]);
        origin_x[l] = eyes[c];
        turn_x[l] = ray.x;
        turn_y = ray.y;
    }
    twins = origin_x[0] == origin_x[2] && turn_x[0] == turn_x[2];
#else
    vec3 ray = ray_direction(place + vec2(columns[0], 0.0), eyes[0]);
    origin_x[0] = eyes[0];
#endif
#else
    vec3 ray = ray_direction(gl_FragCoord.xy - view.yz, view.x);
    origin_x[0] = view.x;
#endif
#if LANES == 1
    pick[0] = vec3(1.0);
    turn_x[0] = ray.x;
    turn_y = ray.y;
    twins = false;
#endif
    for (int l = 0; l < LANES; ++l) {
        stop[l] = 1e30;
#ifdef OPAQUE
        vec4 before = texelFetch(depth_before, ivec2(gl_FragCoord.xy), 0);
        float z = LANES == 1 ? before.r : dot(pick[l], before.rgb);
        stop[l] = z < 1.0 ? depth_from_window(z) : 1e30;
#endif
    }
}

// What was there before, opacity last.
vec4 before() {
#ifdef COVERED
    return texelFetch(color_before, ivec2(gl_FragCoord.xy), 0);
#else
    return vec4(background, 0.0);
#endif
}

// Light that is premultiplied over what was there before.
vec4 over(vec3 light, vec3 through) {
    vec4 behind = before();
    return vec4(quantized(light + through * behind.rgb), 1.0 - through.x * (1.0 - behind.a));
}
