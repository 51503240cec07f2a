// Classification of a slab by a 2-D table of pre-integrated slabs (Engel 2001; scene/preintegration.py), and its light.
// Needs volume.glsl, volume_light.glsl. Switches: SHADED; GRADIENTS: lit by the mean of the gradients at its ends
// (Huebner 2007a, section 3.3), else by the gradient in its middle, at the price of a lookup.

uniform sampler2D slab_table[VOLUMES];   // (front, back): colour times extinction, extinction; bilinear
uniform vec2 table_place[VOLUMES];       // scale and offset of a scalar's place in it

float alpha[LANES];                      // opacity of the slab
vec3 emitted[LANES];                     // its colour
float optical[LANES];                    // its optical depth
bool shows[VOLUMES];                     // whether a volume takes part in it on lane 0

// Colour under light times extinction, and extinction, of one ray.
vec4 classify_ray(int v, int l) {
    int i = v * LANES + l;
    vec2 place = vec2(s_back[i], s_front[i]) * table_place[v].x + table_place[v].y;
    vec4 texel = textureLod(slab_table[v], place, 0.0);
#ifdef SHADED
    if (texel.a > 0.0) {
        vec3 point = vec3(0.0), eye = vec3(0.0, lens.w, 0.0);
        float middle = 0.5 * (near_end[i] + far_end[i]);
#ifdef PLACED
        point = eye_point(l, middle);
#endif
#ifdef GRADIENTS
        vec3 gradient = g_front[i] + g_back[i];
#else
        vec3 gradient = 2.0 * gradient_of(voxel_at(v, origin_x[l] + middle * turn_x[l], middle));
#endif
#ifdef OWN_EYES
        eye.x = origin_x[l];
#endif
        vec3 reflected, highlight;
        light_inside(v, gradient, point, eye, reflected, highlight);
        texel.rgb = texel.rgb * reflected + texel.a * highlight;
    }
#endif
    return texel;
}

// Fill alpha, emitted and optical. Volumes add their optical depths, and mix their colours by them. Lanes that share
// their lookups at both ends share all but their length.
void classify() {
    int count = max(front_lanes, back_lanes);
    vec4 first = vec4(0.0);
    for (int l = 0; l < LANES; ++l) {
        vec4 sum = vec4(0.0);
        for (int v = 0; v < VOLUMES; ++v) {
            int i = v * LANES + l;
            vec4 texel = first;
            if (l < count) {
                texel = classify_ray(v, l);
            }
            if (l == 0) {
                first = texel;  // read where lanes share, and they do so of one volume only
                shows[v] = texel.a > 0.0;
            }
            sum += texel * ((far_end[i] - near_end[i]) * ray_length(l));
        }
        optical[l] = sum.a;
        alpha[l] = 1.0 - exp(-sum.a);
        emitted[l] = sum.rgb / max(sum.a, TINY);
    }
}

// Depth at which a ray of transmittance `previous` before the slab has lost half of its light: optical depth is taken to
// grow linearly through the part of the slab that volumes fill.
float half_depth(float previous) {
    float first = 1e30, last = -1e30;
    for (int v = 0; v < VOLUMES; ++v) {
        if (shows[v] && far_end[v * LANES] > near_end[v * LANES]) {
            first = min(first, near_end[v * LANES]);
            last = max(last, far_end[v * LANES]);
        }
    }
    return first + log(2.0 * previous) / optical[0] * (last - first);
}
