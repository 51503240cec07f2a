// Classification of a slab by a 2-D table of pre-integrated slabs (Engel 2001; scene/preintegration.py), and its light.
// Needs filtering.glsl, volume.glsl, volume_light.glsl, volume_target.glsl. Switches: SHADED; MIDDLE: lit in its middle, at
// the price of a lookup, else by the mean of the light at its ends; OWN_EYES: highlights are those of each ray's eye, else of
// the centre's; HALF_DEPTH.
//
// A vec3 is of three lanes, each for its own channel, or of one ray's three channels: SHOWN is what one lane shows.

uniform sampler2D slab_table[VOLUMES];   // (front, back): colour times extinction, extinction; bilinear
uniform vec2 table_place[VOLUMES];       // scale and offset of a scalar's place in it

#if LANES == 3
#define SHOWN float
float shown(vec3 channels, int l) { return dot(channels, pick(l)); }
float part(vec3 all, int l) { return of(all, l); }
vec3 with_part(vec3 all, int l, float x) { return with(all, l, x); }
#else
#define SHOWN vec3
vec3 shown(vec3 channels, int l) { return channels; }
vec3 part(vec3 all, int l) { return all; }
vec3 with_part(vec3 all, int l, vec3 x) { return x; }
#endif

LANE optical;                            // optical depth of the slab
vec3 glow;                               // colour under light times optical depth
#ifdef HALF_DEPTH
LANE fill_begin, fill_end;               // between which depths it holds anything
#endif
vec3 lit_front[VOLUMES], lit_back[VOLUMES];        // what light multiplies colours by
vec3 shine_front[VOLUMES], shine_back[VOLUMES];    // and what it adds

struct Classified {
    vec4 texel;                          // colour times extinction, extinction
    vec3 reflected, highlight;
};
Classified first[VOLUMES];               // on lane 0, for lanes that are as it is

void begin_slab() {
    optical = LANE(0.0);
    glow = vec3(0.0);
#ifdef HALF_DEPTH
    fill_begin = LANE(1e30);
    fill_end = LANE(-1e30);
#endif
}

Classified classify(int v, int l, vec4 voxel) {
    Classified c;
    vec2 place = vec2(voxel.a, of(s_front[v], l)) * table_place[v].x + table_place[v].y;
    c.texel = looked_up(slab_table[v], place);
#ifdef SHADED
    vec3 point = vec3(0.0), eye = vec3(0.0, lens.w, 0.0);
#ifdef MIDDLE
    float t = 0.5 * (of(near_end[v], l) + of(far_end[v], l));
    voxel = voxel_on_ray(v, l, t);
#else
    float t = of(far_end[v], l);
#endif
    point = eye_point(l, t);
#ifdef OWN_EYES
    eye.x = of(origin_x, l);
#endif
    light_inside(v, gradient_of(voxel), point, eye, c.reflected, c.highlight);
#endif
    return c;
}

// Add lane l of volume v. Volumes add their optical depths, and mix their colours by them.
void add_to_slab(int v, int l, Classified c) {
    float length_here = (of(far_end[v], l) - of(near_end[v], l)) * of(ray_length, l);
    SHOWN own = shown(c.texel.rgb, l);
#ifdef SHADED
    SHOWN lit = shown(c.reflected, l), shine = shown(c.highlight, l);
#ifdef MIDDLE
    own = own * lit + c.texel.a * shine;
#else
    own = 0.5 * (own * (part(lit_front[v], l) + lit) + c.texel.a * (part(shine_front[v], l) + shine));
    lit_back[v] = with_part(lit_back[v], l, lit);
    shine_back[v] = with_part(shine_back[v], l, shine);
#endif
#endif
    optical = with(optical, l, of(optical, l) + c.texel.a * length_here);
    glow = with_part(glow, l, part(glow, l) + own * length_here);
#ifdef HALF_DEPTH
    bool fills = c.texel.a * length_here > 0.0;
    fill_begin = with(fill_begin, l, min(of(fill_begin, l), fills ? of(near_end[v], l) : 1e30));
    fill_end = with(fill_end, l, max(of(fill_end, l), fills ? of(far_end[v], l) : -1e30));
#endif
}

void visit(int v, int l, vec4 voxel) {
    if (v == 0 && l == 0) {
        begin_slab();
    }
    Classified c = classify(v, l, voxel);
    add_to_slab(v, l, c);
    if (l == 0) {
        first[v] = c;
    }
}

// Opacity of the slab, at its end. Lanes that were not looked up are as the first but for their length.
LANE slab_alpha() {
    for (int l = 1; l < LANES; ++l) {
        if (rounds < l + 1) {
            for (int v = 0; v < VOLUMES; ++v) {
                add_to_slab(v, l, first[v]);
            }
        }
    }
    lit_front = lit_back;
    shine_front = shine_back;
    return 1.0 - exp(-optical);
}
