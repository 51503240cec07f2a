// Volumes along the rays of a fragment, slab after slab: a stretch of depth between two slices, the same for all views
// (Huebner 2007a, section 3.2; engines/reference/volume.py). Needs frame.glsl, lanes.glsl, filtering.glsl. Filled by
// volume_space.py.
//
// Switches: VOLUMES; HALVES, half-spaces of each.
//
// What follows is shaped by llvmpipe, which carries out both sides of an `if`, and every loop at least once: rays are
// looked up in a loop of as many rounds as there are different ones, and what is empty is skipped in a loop.

uniform sampler3D voxels[VOLUMES];        // gradient, 0 at STEPS, 65535 steps in all; scalar 0 ... 1 of its range
uniform usampler3D emptiness[VOLUMES];    // of blocks of BLOCK^3 cells: how many blocks away, any way, something shows
uniform mat4 index_from_eye[VOLUMES];
uniform vec3 voxel_count[VOLUMES];
uniform vec4 half_spaces[VOLUMES * HALVES];  // a volume is seen where h.(x, y, z, 1) >= 0 in eye space
uniform vec3 slices;                      // depth of the first; distance; number of slabs
uniform float share_within;               // rays closer together, in voxels, share a lookup; < 0: only equal rays
uniform float along;                      // greatest number of voxels per unit of X

// --- rays: eyes at (origin_x, lens.w, 0), and what X and Y gain per unit of depth. Lanes 0 and 2 are the nearest eyes.
LANE origin_x, turn_x;
float turn_y;
LANE stop;                                // depth of what is opaque
bool twins;                               // lanes 0 and 2 are the same ray

// --- the slab that is looked at
LANE enter[VOLUMES], leave[VOLUMES];
LANE near_end[VOLUMES], far_end[VOLUMES];
int slab, slab_end;
int rounds;                               // lanes that are looked up; the others see from beside what lane 0 finds
LANE s_front[VOLUMES], s_back[VOLUMES];   // scalars at its ends
float left;                               // rays are followed while this is more than 0

// A shader says what it does of a slab: in every round with the voxel at the far end on lane l of volume v; and when all
// lanes were looked up.
void visit(int v, int l, vec4 voxel);
void end_slab();

vec3 eye_point(int l, float t) {
    return vec3(of(origin_x, l) + t * of(turn_x, l), lens.w + t * turn_y, t);
}

vec3 index_at(int v, float x, float t) {
    mat4 m = index_from_eye[v];
    return m[0].xyz * x + (m[1].xyz * (lens.w + t * turn_y) + (m[2].xyz * t + m[3].xyz));
}

vec4 voxel_at(int v, float x, float t) {
    return interpolated(voxels[v], index_at(v, x, t), voxel_count[v]);
}

vec4 voxel_on_ray(int v, int l, float t) {
    return voxel_at(v, of(origin_x, l) + t * of(turn_x, l), t);
}

vec3 gradient_of(vec4 voxel) {
    return voxel.rgb * 65535.0 - STEPS;
}

float most_of(vec3 a) {
    return max(a.x, max(a.y, a.z));
}

// Depths at which rays enter and leave what is seen of the volumes, from depth `near` on.
void find_stretches(float near) {
    float begin = 1e30, end = -1e30;
    for (int v = 0; v < VOLUMES; ++v) {
        LANE low = LANE(near), high = stop;
        for (int h = 0; h < HALVES; ++h) {
            vec4 row = half_spaces[v * HALVES + h];
            LANE start = row.x * origin_x + (row.y * lens.w + row.w);
            LANE slope = row.x * turn_x + (row.y * turn_y + row.z);
            LANE crossing = -start / choose(same(slope, LANE(0.0)), LANE(1.0), slope);
            low = choose(less(LANE(0.0), slope), max(low, crossing), low);
            LANE beside = choose(less(start, LANE(0.0)), LANE(-1.0), high);
            high = choose(less(slope, LANE(0.0)), min(high, crossing), choose(same(slope, LANE(0.0)), beside, high));
        }
        enter[v] = low;
        leave[v] = max(low, high);
        begin = min(begin, least(choose(less(low, high), low, LANE(1e30))));
        end = max(end, greatest(choose(less(low, high), high, LANE(-1e30))));
    }
    slab = clamp(int(floor((begin - slices.x) / slices.y)), 0, int(slices.z));
    slab_end = end > begin ? min(int(ceil((end - slices.x) / slices.y)), int(slices.z)) : slab;
}

// How many slabs from depth t on are empty for all rays: what shows is at least this many voxels away.
int empty_slabs(float t) {
    LANE x = origin_x + t * turn_x;
    vec2 range = vec2(least(x), greatest(x)), turns = vec2(least(turn_x), greatest(turn_x));
    float most = 1e30;
    for (int v = 0; v < VOLUMES; ++v) {
        mat4 m = index_from_eye[v];
        vec3 p = clamp(index_at(v, 0.5 * (range.x + range.y), t), vec3(0.0), voxel_count[v] - 1.001);
        ivec3 block = ivec3(p) >> BLOCK_BITS;
        float blocks = float(texelFetch(emptiness[v], block, 0).r);
        vec3 deeper = m[1].xyz * turn_y + m[2].xyz;
        vec3 speed = max(abs(m[0].xyz * turns.x + deeper), abs(m[0].xyz * turns.y + deeper)) * slices.y;
        vec3 off = abs(p - (vec3(block) + 0.5) * float(BLOCK));
        vec3 side = 0.5 * (range.y - range.x) * abs(m[0].xyz);
        float away = (blocks - 0.5) * float(BLOCK) - most_of(off) - most_of(side);
        most = min(most, away / most_of(speed));
    }
    return int(clamp(most, 0.0, 1e6));
}

// How many lookups rays need at depth t: 1 or 2 where they lie within 2*share_within voxels of each other, so that a
// lookup between them is share_within voxels off at most; not where one of them is not inside.
int lookups(float t) {
#if LANES == 1
    return 1;
#else
    LANE x = origin_x + t * turn_x;
    float range = greatest(x) - least(x), within = 2.0 * share_within;
    bool inside = VOLUMES == 1 && every(not_less(LANE(t), enter[0])) && every(not_less(leave[0], LANE(t)));
    return inside && range * along <= within ? 1 : twins || (inside && abs(x.x - x.z) * along <= within) ? 2 : 3;
#endif
}

// Look up the far end of the slab on lane l, first on lane 0, which may stand for others: what those see beside it is
// found by its gradient, if there is one.
void look_up(int l) {
    for (int v = 0; v < VOLUMES; ++v) {
        float own = of(far_end[v], l);
        LANE x = origin_x + own * turn_x;
        float at = of(x, l);
#if LANES == 3
        at = rounds == 1 ? 0.5 * (least(x) + greatest(x)) : rounds == 2 && l == 0 ? 0.5 * (x.x + x.z) : at;
#endif
        vec4 voxel = voxel_at(v, at, own);
        LANE scalar = LANE(voxel.a);
#if LANES == 3 && defined(SHADED)
        scalar += dot(gradient_of(voxel), index_from_eye[v][0].xyz) / STEPS * (x - at);
#endif
        s_back[v] = l == 0 ? scalar : with(s_back[v], l, of(scalar, l));
        visit(v, l, voxel);
    }
}

// Take the rays through all slabs in which something may show. Where what was before is empty, a slab of no thickness
// comes first, for its scalars.
void march() {
    if (slab >= slab_end) {
        return;
    }
    bool fresh = true;
    do {
        int skipped;
        do {
            skipped = empty_slabs(slices.x + float(slab) * slices.y);
            slab += skipped;
            fresh = fresh || skipped > 0;
        } while (skipped > 0 && slab < slab_end);
        int look_again = min(slab_end, (slab | (BLOCK - 1)) + 1);
        do {
            float t = slices.x + float(slab) * slices.y, after = slices.x + float(slab + 1) * slices.y;
            after = fresh ? t : after;
            rounds = lookups(after);
            for (int v = 0; v < VOLUMES; ++v) {
                near_end[v] = clamp(LANE(t), enter[v], leave[v]);
                far_end[v] = clamp(LANE(after), enter[v], leave[v]);
            }
            int l = 0;
            do {
                look_up(l);
                ++l;
            } while (l < rounds);
            end_slab();
            s_front = s_back;
            slab += fresh ? 0 : 1;
            fresh = false;
        } while (slab < look_again && left > 0.0);
    } while (slab < slab_end && left > 0.0);
}
