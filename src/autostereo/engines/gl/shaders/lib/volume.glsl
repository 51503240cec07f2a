// Volumes along the rays of a fragment, slab after slab: a stretch of depth between two slices, the same for all views
// (Huebner 2007a, section 3.2; engines/reference/volume.py). Needs frame.glsl. Filled by volume_space.py.
//
// Switches: VOLUMES; HALVES, half-spaces of each; LANES, rays of a fragment: 1, or 3 for the sub-pixels of a pixel;
// GRADIENTS: they are wanted at the ends of slabs.

uniform sampler3D voxels[VOLUMES];        // gradient, 0 at STEPS, 65535 steps in all; scalar 0 ... 1 of its range
uniform usampler3D emptiness[VOLUMES];    // of blocks of BLOCK^3 cells: how many blocks away, any way, something shows
uniform mat4 index_from_eye[VOLUMES];
uniform vec3 voxel_count[VOLUMES];
uniform vec4 half_spaces[VOLUMES * HALVES];  // a volume is seen where h.(x, y, z, 1) >= 0 in eye space
uniform vec3 slices;                      // depth of the first; distance; number of slabs
uniform float share_within;               // rays closer together, in voxels, share a lookup; < 0: only equal rays
uniform float along;                      // greatest number of voxels per unit of X

// --- rays: eyes at (origin_x, lens.w, 0), and what X and Y gain per unit of depth. Lanes 0 and 2 are the two nearest eyes.
float origin_x[LANES];
float turn_x[LANES];
float turn_y;
float stop[LANES];                        // depth of what is opaque
bool twins;                               // lanes 0 and 2 are the same ray

// --- slabs
float enter[VOLUMES * LANES], leave[VOLUMES * LANES];
int slab, slab_end;
int front_lanes, back_lanes;              // how many of the lanes were looked up at either end; the others are as lane 0
float near_end[VOLUMES * LANES], far_end[VOLUMES * LANES];
float s_front[VOLUMES * LANES], s_back[VOLUMES * LANES];
vec3 g_front[VOLUMES * LANES], g_back[VOLUMES * LANES];
float fastest[VOLUMES];                   // voxels per depth

float ray_length(int lane) {
    return sqrt(1.0 + turn_y * turn_y + turn_x[lane] * turn_x[lane]);
}

vec3 eye_point(int lane, float t) {
    return vec3(origin_x[lane] + t * turn_x[lane], lens.w + t * turn_y, t);
}

vec3 index_at(int v, float x, float t) {
    mat4 m = index_from_eye[v];
    return m[0].xyz * x + (m[1].xyz * (lens.w + t * turn_y) + (m[2].xyz * t + m[3].xyz));
}

vec4 voxel_at(int v, float x, float t) {
    return textureLod(voxels[v], (index_at(v, x, t) + 0.5) / voxel_count[v], 0.0);
}

vec3 gradient_of(vec4 voxel) {
    return voxel.rgb * 65535.0 - STEPS;
}

// Depths at which rays enter and leave what is seen of the volumes, from depth `near` on.
void find_stretches(float near) {
    float begin = 1e30, end = -1e30;
    for (int v = 0; v < VOLUMES; ++v) {
        fastest[v] = 0.0;
        for (int l = 0; l < LANES; ++l) {
            float low = near, high = stop[l];
            for (int h = 0; h < HALVES; ++h) {
                vec4 row = half_spaces[v * HALVES + h];
                float start = row.x * origin_x[l] + (row.y * lens.w + row.w);
                float slope = row.x * turn_x[l] + (row.y * turn_y + row.z);
                float crossing = -start / (slope == 0.0 ? 1.0 : slope);
                low = slope > 0.0 ? max(low, crossing) : low;
                high = slope < 0.0 ? min(high, crossing) : (slope == 0.0 && start < 0.0 ? -1.0 : high);
            }
            int i = v * LANES + l;
            enter[i] = low;
            leave[i] = max(low, high);
            if (high > low) {
                begin = min(begin, low);
                end = max(end, high);
            }
            mat4 m = index_from_eye[v];
            vec3 speed = abs(m[0].xyz * turn_x[l] + (m[1].xyz * turn_y + m[2].xyz));
            fastest[v] = max(fastest[v], max(speed.x, max(speed.y, speed.z)));
        }
    }
    slab = max(int(floor((begin - slices.x) / slices.y)), 0);
    slab_end = end > begin ? min(int(ceil((end - slices.x) / slices.y)), int(slices.z)) : slab;
    front_lanes = back_lanes = 0;
}

// Least and greatest X of the lanes.
vec2 spread(float t) {
    float first = origin_x[0] + t * turn_x[0];
    vec2 range = vec2(first);
    for (int l = 1; l < LANES; ++l) {
        float x = origin_x[l] + t * turn_x[l];
        range = vec2(min(range.x, x), max(range.y, x));
    }
    return range;
}

// How many slabs from depth t on are empty for all rays: what shows is at least this many voxels away.
int empty_slabs(float t) {
    vec2 range = spread(t);
    float most = 1e30;
    for (int v = 0; v < VOLUMES; ++v) {
        vec3 p = clamp(index_at(v, 0.5 * (range.x + range.y), t), vec3(0.0), voxel_count[v] - 1.001);
        ivec3 block = ivec3(p) >> BLOCK_BITS;
        float blocks = float(texelFetch(emptiness[v], block, 0).r);
        vec3 off = abs(p - (vec3(block) + 0.5) * float(BLOCK));
        float away = (blocks - 0.5) * float(BLOCK) - max(off.x, max(off.y, off.z));
        vec3 side = 0.5 * (range.y - range.x) * abs(index_from_eye[v][0].xyz);
        away -= max(side.x, max(side.y, side.z));
        most = min(most, away / (fastest[v] * slices.y));
    }
    return int(clamp(most, -1.0, 1e6));
}

// How many lookups three rays need at depth t: 1 or 2 where rays lie within 2*share_within voxels of each other, so
// that a lookup between them is share_within voxels off at most.
int lookups(float t) {
#if LANES == 1
    return 1;
#else
    vec2 range = spread(t);
    float pair = abs(origin_x[0] + t * turn_x[0] - origin_x[2] - t * turn_x[2]);
    float within = 2.0 * share_within;
    return (range.y - range.x) * along <= within ? 1 : twins || pair * along <= within ? 2 : 3;
#endif
}

// Look up the volumes where lanes are at depth t, clamped to their stretches.
void look_up(float t, int count, out float s[VOLUMES * LANES], out vec3 g[VOLUMES * LANES]) {
    for (int v = 0; v < VOLUMES; ++v) {
        for (int l = 0; l < LANES; ++l) {
            int i = v * LANES + l;
            if (l < count) {
                float own = clamp(t, enter[i], leave[i]);
                float x = origin_x[l] + own * turn_x[l];
#if LANES == 3
                if (l == 0 && count < 3) {
                    vec2 range = count == 1 ? spread(own) : vec2(x, origin_x[2] + own * turn_x[2]);
                    x = 0.5 * (range.x + range.y);
                }
#endif
                vec4 found = voxel_at(v, x, own);
                s[i] = found.a;
#ifdef GRADIENTS
                g[i] = gradient_of(found);
#else
                g[i] = vec3(0.0);
#endif
            } else {
                s[i] = s[v * LANES];
                g[i] = g[v * LANES];
            }
        }
    }
}

// Go on to the next slab in which something may show, and look up both its ends; false behind the last one.
bool next_slab() {
    bool fresh = back_lanes == 0;
    float t = slices.x + float(slab) * slices.y;
    while (slab < slab_end && (fresh || (slab & 3) == 0)) {
        int skipped = empty_slabs(t);
        if (skipped < 1) {
            break;
        }
        fresh = true;
        slab += skipped;
        t = slices.x + float(slab) * slices.y;
    }
    if (slab >= slab_end) {
        return false;
    }
    ++slab;
    float after = slices.x + float(slab) * slices.y;
    bool inside = true;
    for (int i = 0; i < VOLUMES * LANES; ++i) {
        near_end[i] = clamp(t, enter[i], leave[i]);
        far_end[i] = clamp(after, enter[i], leave[i]);
        inside = inside && enter[i] <= t && leave[i] >= after;
    }
    int apart = LANES == 1 ? 1 : twins ? 2 : 3;
    bool sharing = inside && VOLUMES == 1;
    if (fresh) {
        front_lanes = sharing ? lookups(t) : apart;
        look_up(t, front_lanes, s_front, g_front);
    } else {
        front_lanes = back_lanes;
        s_front = s_back;
        g_front = g_back;
    }
    back_lanes = sharing ? lookups(after) : apart;
    look_up(after, back_lanes, s_back, g_back);
    return true;
}
