// Classification of a slab by a 2-D table of pre-integrated slabs (Engel 2001; scene/preintegration.py), and its light.
// Needs filtering.glsl, volume.glsl, volume_light.glsl, volume_target.glsl. Switches: SHADED; MIDDLE: lit in its middle, at
// the price of a lookup, else by the mean of the light at its ends; OWN_EYES: highlights are those of each ray's eye, else of
// the centre's; HALF_DEPTH.
//
// A vec3 is of three lanes, each for its own channel, or of one ray's three channels.

uniform sampler2D slab_table[VOLUMES];   // (front, back), bilinear: colour times extinction, extinction; for three lanes the
                                         // channels one above the other, each with the extinction
uniform vec2 table_place[VOLUMES];       // scale and offset of a scalar's place in it

#if LANES == 3
#define SLAB vec2                        // what a slab is for one lane: colour times extinction, extinction
float part(vec3 all, int l) { return of(all, l); }
vec3 with_part(vec3 all, int l, float x) { return with(all, l, x); }
#else
#define SLAB vec4
vec3 part(vec3 all, int l) { return all; }
vec3 with_part(vec3 all, int l, vec3 x) { return x; }
#endif

LANE optical;                            // optical depth of the slab
vec3 glow;                               // colour under light times optical depth
#ifdef HALF_DEPTH
LANE fill_begin, fill_end;               // between which depths it holds anything
#endif
vec3 lit[VOLUMES], shine[VOLUMES];       // what light multiplies colours by, and what it adds
#ifndef MIDDLE
struct Gradients { LANE x, y, z; };
Gradients g_front[VOLUMES], g_back[VOLUMES];  // at its ends
#endif

SLAB slab_texel(int v, int l) {
    vec2 place = vec2(of(s_back[v], l), of(s_front[v], l)) * table_place[v].x + table_place[v].y;
#if LANES == 3
    int c = l == 0 ? order.x : l == 1 ? order.y : order.z;
    float edge = 0.5 / float(textureSize(slab_table[v], 0).x);
    return looked_up(slab_table[v], vec2(place.x, (clamp(place.y, edge, 1.0 - edge) + float(c)) / 3.0)).rg;
#else
    return looked_up(slab_table[v], place);
#endif
}

// Light on lane l of volume v; that of lane 0 for all that are not looked up.
void visit(int v, int l, vec4 voxel) {
#ifdef SHADED
    float t = 0.5 * (of(near_end[v], l) + of(far_end[v], l));
#ifdef MIDDLE
    vec3 gradient = gradient_of(voxel_on_ray(v, l, t));
#else
    vec3 found = gradient_of(voxel);
    vec3 before = vec3(of(g_front[v].x, l), of(g_front[v].y, l), of(g_front[v].z, l));
    vec3 gradient = 0.5 * (before + found);
    g_back[v].x = l == 0 ? LANE(found.x) : with(g_back[v].x, l, found.x);
    g_back[v].y = l == 0 ? LANE(found.y) : with(g_back[v].y, l, found.y);
    g_back[v].z = l == 0 ? LANE(found.z) : with(g_back[v].z, l, found.z);
#endif
    vec3 eye = vec3(0.0, lens.w, 0.0), reflected, highlight;
#ifdef OWN_EYES
    eye.x = of(origin_x, l);
#endif
    light_inside(v, gradient, eye_point(l, t), eye, reflected, highlight);
    reflected = by_lane(reflected);
    highlight = by_lane(highlight);
#if LANES == 3
    lit[v] = l == 0 ? reflected : with(lit[v], l, of(reflected, l));
    shine[v] = l == 0 ? highlight : with(shine[v], l, of(highlight, l));
#else
    lit[v] = reflected;
    shine[v] = highlight;
#endif
#endif
}

// Add lane l of volume v. Volumes add their optical depths, and mix their colours by them.
void add_to_slab(int v, int l) {
    float length_here = (of(far_end[v], l) - of(near_end[v], l)) * of(ray_length, l);
    SLAB texel = slab_texel(v, l);
#if LANES == 3
    float own = texel.x, extinction = texel.y;
#else
    vec3 own = texel.rgb;
    float extinction = texel.a;
#endif
#ifdef SHADED
    own = own * part(lit[v], l) + extinction * part(shine[v], l);
#endif
    optical = with(optical, l, of(optical, l) + extinction * length_here);
    glow = with_part(glow, l, part(glow, l) + own * length_here);
#ifdef HALF_DEPTH
    bool fills = extinction * length_here > 0.0;
    fill_begin = with(fill_begin, l, min(of(fill_begin, l), fills ? of(near_end[v], l) : 1e30));
    fill_end = with(fill_end, l, max(of(fill_end, l), fills ? of(far_end[v], l) : -1e30));
#endif
}

// Opacity of the slab, at its end.
LANE slab_alpha() {
    optical = LANE(0.0);
    glow = vec3(0.0);
#ifdef HALF_DEPTH
    fill_begin = LANE(1e30);
    fill_end = LANE(-1e30);
#endif
    for (int v = 0; v < VOLUMES; ++v) {
        for (int l = 0; l < LANES; ++l) {
            add_to_slab(v, l);
        }
    }
#ifndef MIDDLE
    g_front = g_back;
#endif
    return 1.0 - exp(-optical);
}
