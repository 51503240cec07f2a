// Surfels, made ready for all views by points_setup.comp. Needs frame.glsl and shading.glsl.
//
// The plane n.(X - P) = 0 of a disc is met at depth n.(P - eye)/n.ray (Huebner 2007b, equation 2), where it weighs
// 1 - |X - P|^2/r^2. Where it appears less than a pixel wide it stands upright, as an ellipse: a plane of normal
// (0, 0, 1) and other half axes (engines/reference/points.py). With a = (P - eye).x/d, the squares of the half axes of
// its projection are the roots of t^2 - S(a) t + A(a)^2, S quadratic and A linear in a: the lesser is below 1/4 where
// the polynomial is negative at 1/4, or both roots are below.
//
// Switches: PANEL: each fragment meets a disc with three rays, one per channel, else with one; OWN_EYE: highlights.

#ifdef PANEL
#define real vec3
#define chosen(no, yes, which) mix(no, yes, greaterThan(which, vec3(0.0)))
#else
#define real float
#define chosen(no, yes, which) ((which) > 0.0 ? (yes) : (no))
#endif

struct Surfel {
    vec4 place;   // P in eye space; radius
    vec4 normal;  // unit, turned to the centre camera, (0, 0, -1) if it has none; group
    vec4 shape;   // S(a) = x + a (y + a z); 1/r^2
    vec4 area;    // A(a) = x + a y; specular, shininess
    vec4 color;   // lit, without what only a view's own eye sees; unused
    vec4 box;     // left, right, top, bottom of what any view sees of it, in pixels from its centre
};

#ifdef OWN_EYE
// Highlights that the eyes at camera offsets v see at a point; gloss: specular, shininess.
vec3 highlights(real v, vec3 point, vec3 normal, vec2 gloss) {
    vec3 sum = vec3(0.0);
    real x = v - point.x;
    float y = lens.w - point.y, z = -point.z;
    real scale = inversesqrt(max(x * x + y * y + z * z, TINY));
    for (int k = 0; k < LIGHTS; ++k) {
        vec3 towards = unit(light_place[k].xyz - light_place[k].w * point);
        real hx = towards.x + x * scale, hy = towards.y + y * scale, hz = towards.z + z * scale;
        real along = normal.x * hx + normal.y * hy + normal.z * hz;
        real cosine = max(along * inversesqrt(max(hx * hx + hy * hy + hz * hz, TINY)), 0.0);
        if (gloss.x > 0.0 && dot(normal, towards) > 0.0) {
            sum += gloss.x * (gloss.y == 0.0 ? real(1.0) : pow(cosine, real(gloss.y))) * light_color[k];
        }
    }
    return sum;
}
#endif
