// Classification of a slab by a 2-D table of pre-integrated slabs (Engel 2001; scene/preintegration.py), and its light.
// Needs volume.glsl, volume_light.glsl, volume_target.glsl. Switches: SHADED; GRADIENTS: lit by the mean of the gradients
// at its ends (Huebner 2007a, section 3.3), else by the gradient in its middle, at the price of a lookup; OWN_EYES:
// highlights are those of each ray's eye, else of the centre's.

uniform sampler2D slab_table[VOLUMES];   // (front, back): colour times extinction, extinction; bilinear
uniform vec2 table_place[VOLUMES];       // scale and offset of a scalar's place in it

LANE optical;                            // optical depth of the slab
vec3 glow;                               // colour times optical depth: of the ray, or each lane's channel of it
vec4 first_texel;
LANE fill_begin, fill_end;               // between which depths it holds anything

// Colour under light times extinction, and extinction, of one ray.
vec4 classify(int v, int l) {
    vec2 place = vec2(of(s_back[v], l), of(s_front[v], l)) * table_place[v].x + table_place[v].y;
    vec4 texel = textureLod(slab_table[v], place, 0.0);
#ifdef SHADED
    vec3 point = vec3(0.0), eye = vec3(0.0, lens.w, 0.0);
    float middle = 0.5 * (of(near_end[v], l) + of(far_end[v], l));
#ifdef PLACED
    point = eye_point(l, middle);
#endif
#ifdef OWN_EYES
    eye.x = of(origin_x, l);
#endif
#ifdef GRADIENTS
    vec3 gradient = vec3(of(gx_front[v], l) + of(gx_back[v], l), of(gy_front[v], l) + of(gy_back[v], l),
                         of(gz_front[v], l) + of(gz_back[v], l));
#else
    vec3 gradient = 2.0 * gradient_of(voxel_on_ray(v, l, middle));
#endif
    vec3 reflected, highlight;
    light_inside(v, gradient, point, eye, reflected, highlight);
    texel.rgb = texel.rgb * reflected + texel.a * highlight;
#endif
    return texel;
}

void begin_slab() {
    optical = LANE(0.0);
    glow = vec3(0.0);
    fill_begin = LANE(1e30);
    fill_end = LANE(-1e30);
}

// Add lane l of volume v. Volumes add their optical depths, and mix their colours by them.
void add_to_slab(int v, int l) {
    vec4 texel = classify(v, l);
    float length_here = (of(far_end[v], l) - of(near_end[v], l)) * of(ray_length, l);
    optical = with(optical, l, of(optical, l) + texel.a * length_here);
#if LANES == 3
    first_texel = l == 0 ? texel : first_texel;
    glow = with(glow, l, of(glow, l) + dot(texel.rgb, pick(l)) * length_here);
#else
    glow += texel.rgb * length_here;
#endif
    if (texel.a * length_here > 0.0) {
        fill_begin = with(fill_begin, l, min(of(fill_begin, l), of(near_end[v], l)));
        fill_end = with(fill_end, l, max(of(fill_end, l), of(far_end[v], l)));
    }
}

// Opacity of the slab. Lanes that differ in nothing but their length, of one volume, are as the first.
LANE slab_alpha() {
#if LANES == 3
    vec3 length_here = (far_end[0] - near_end[0]) * ray_length;
    for (int l = 1; l < 3; ++l) {
        if (rounds < (l == 1 ? 2 : 3)) {
            optical = with(optical, l, first_texel.a * of(length_here, l));
            glow = with(glow, l, dot(first_texel.rgb, pick(l)) * of(length_here, l));
        }
    }
#endif
    return 1.0 - exp(-optical);
}
