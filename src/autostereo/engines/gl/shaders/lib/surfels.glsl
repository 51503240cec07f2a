// Surfels, made ready for all views by points_setup.comp. Needs frame.glsl, shading.glsl and memory.glsl.
//
// The plane n.(X - P) = 0 of a disc is met at depth n.(P - eye)/n.ray (Huebner 2007b, equation 2), where it weighs
// 1 - |X - P|^2/r^2. Where it appears less than a pixel wide, or has no normal, it stands upright, as an ellipse: a plane of
// normal (0, 0, 1) and other half axes (engines/reference/points.py). With a = (P - eye).x/d, the squares of the half axes of
// its projection are the roots of t^2 - S(a) t + A(a)^2, S quadratic and A linear in a: the lesser is below 1/4 where
// the polynomial is negative at 1/4, or both roots are below.
//
// Discs have two sides, each lit at P; every eye sees its own. Switches: THREE_RAYS: three rays, one per channel of a pixel,
// meet a disc at a time, else one; SIDES: eyes may see different sides lit; OWN_EYE: their own highlights, too.

#ifdef THREE_RAYS
#define real vec3
#define chosen(no, yes, which) mix(no, yes, greaterThan(which, vec3(0.0)))
#else
#define real float
#define chosen(no, yes, which) ((which) > 0.0 ? (yes) : (no))
#endif

// Texels of a surfel's record.
const int PLACE = 0;   // P in eye space; radius
const int NORMAL = 1;  // unit, turned to the centre camera, (0, 0, -1) if it has none; unused
const int SHAPE = 2;   // S(a) = x + a (y + a z); 1/r^2
const int AREA = 3;    // A(a) = x + a y; specular, shininess
const int COLOR = 4;   // lit on the side that the normal points to, without what only a view's own eye sees; unused
const int BACK = 5;    // on the other side
const int BOX = 6;     // left, right, top, bottom of what any view sees of it, in pixels from its centre
const int RECORD = 7;

#ifdef RECORD_TEXTURE
uniform sampler2D surfels;
#define record_texel(at) texelFetch(surfels, at, 0)
#else
layout(rgba32f, binding = 0) uniform image2D surfels;
#define record_texel(at) imageLoad(surfels, at)
#endif

vec4 record(int number, int texel) {
    return record_texel(place_of(uint(RECORD * number + texel)));
}

#ifdef SIDES
// 1 where the eyes at camera offsets v look at the side that the normal points to, else -1.
real side_seen(real v, vec3 point, vec3 normal) {
    real across = normal.x * (point.x - v) + (normal.y * (point.y - lens.w) + normal.z * point.z);
    return 2.0 * step(across, real(0.0)) - 1.0;
}
#endif

#ifdef OWN_EYE
// Highlights that the eyes at camera offsets v see at a point, on these sides; gloss: specular, shininess.
vec3 highlights(real v, real side, vec3 point, vec3 normal, vec2 gloss) {
    vec3 sum = vec3(0.0);
    real x = v - point.x;
    float y = lens.w - point.y, z = -point.z;
    real scale = inversesqrt(max(x * x + y * y + z * z, TINY));
    for (int k = 0; k < LIGHTS; ++k) {
        vec3 towards = unit(light_place[k].xyz - light_place[k].w * point);
        real hx = towards.x + x * scale, hy = towards.y + y * scale, hz = towards.z + z * scale;
        real along = normal.x * hx + normal.y * hy + normal.z * hz;
        real cosine = max(side * along * inversesqrt(max(hx * hx + hy * hy + hz * hz, TINY)), 0.0);
        real lit = 1.0 - step(side * dot(normal, towards), real(0.0));
        if (gloss.x > 0.0) {
            sum += gloss.x * lit * (gloss.y == 0.0 ? real(1.0) : pow(cosine, real(gloss.y))) * light_color[k];
        }
    }
    return sum;
}
#endif
