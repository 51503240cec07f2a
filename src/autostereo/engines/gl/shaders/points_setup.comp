// Surfels before the cameras: placed, lit at their centres on both sides, and how far they reach in any view; once for all views.
// As engines/cpu/points_setup.py.
#include "lib/frame.glsl"
#include "lib/shading.glsl"
#include "lib/memory.glsl"
#include "lib/surfels.glsl"
#include "lib/invocation.glsl"

layout(local_size_x = 64) in;

layout(std430, binding = 0) readonly buffer Points { float points[]; };  // 12 each: position, radius, normal, material, colour
layout(std430, binding = 2) readonly buffer Materials { vec4 materials[]; };  // ambient, diffuse, specular, shininess

uniform uint count;
uniform vec2 reach;         // least and greatest camera offset

const float LARGEST = 1e5, SMALLEST = 1e-10;  // radius over depth: what is seen of larger discs is seen of these

// Least value of q.x + q.y t + q.z t^2 for t between the ends.
float least_of(vec3 q, vec2 ends) {
    vec2 at = q.x + ends * (q.y + ends * q.z);
    float least = min(at.x, at.y), top = q.z != 0.0 ? -0.5 * q.y / q.z : ends.x;
    return top > ends.x && top < ends.y ? min(least, q.x + top * (q.y + top * q.z)) : least;
}

// How far a disc extends along one axis of the picture, in units of depth, from its centre at p: planes through the eye
// and the picture's line at p + t meet the disc where |t| <= size |n x (their normal)|, t the roots of a quadratic.
vec2 extent(float p, float n, float nd, float size) {
    float c = n - p * nd, square = size * size;
    float lead = 1.0 - square * (1.0 - nd * nd);
    if (lead <= 1e-4) {
        return vec2(-1e15, 1e15);  // it reaches the plane of the eyes
    }
    float middle = square * (p + c * nd);
    float root = sqrt(max(middle * middle + lead * square * (1.0 + p * p - c * c), 0.0));
    return vec2(middle - root, middle + root) / lead;
}

void store(int number, vec4 texels[RECORD]) {
    for (int k = 0; k < RECORD; ++k) {
        imageStore(surfels, place_of(uint(RECORD * number + k)), texels[k]);
    }
}

void main() {
    uint k = invocation();
    if (k >= count) {
        return;
    }
    int number = int(k);
    int at = 12 * number;
    vec3 p = (eye_from_local * vec4(points[at], points[at + 1], points[at + 2], 1.0)).xyz;
    vec3 n = mat3(eye_from_local) * vec3(points[at + 4], points[at + 5], points[at + 6]);
    vec4 material = materials[int(points[at + 7])];
    bool bare = dot(n, n) == 0.0;
    float y = p.y - lens.w;
    n = bare ? vec3(0.0, 0.0, -1.0) : n * inversesqrt(dot(n, n));
    if (n.x * p.x + n.y * y + n.z * p.z > 0.0) {
        n = -n;
    }

    vec4 s[RECORD];
    s[BOX] = vec4(1.0, -1.0, 1.0, -1.0);  // nothing is seen
    if (!(p.z >= depth_range.z)) {
        s[PLACE] = vec4(0.0, 0.0, 1.0, 1.0);
        s[NORMAL] = s[SHAPE] = s[AREA] = s[COLOR] = s[BACK] = vec4(0.0);
        store(number, s);
        return;
    }
    float size = clamp(points[at + 3] / p.z, SMALLEST, LARGEST);
    s[PLACE] = vec4(p, size * p.z);
    s[NORMAL] = vec4(n, 0.0);

    // the ellipse that it projects to, for eyes between the ends of the camera line
    vec2 r = size * lens.xy, a = (p.x - reach.yx) / p.z;
    float b = y / p.z, down = n.y - b * n.z, across = n.y * b + n.z;
    vec3 squares = vec3(r.x * r.x * (1.0 - n.x * n.x) + r.y * r.y * (1.0 + b * b - down * down),
                        2.0 * r.x * r.x * n.x * n.z, r.x * r.x * (1.0 - n.z * n.z));
    vec2 area = r.x * r.y * vec2(across, n.x);
    bool thin = false;
    if (bare) {
        squares = vec3(0.0);  // thin everywhere
        area = vec2(0.0);
    } else {
        vec3 lesser = vec3(area.x * area.x, 2.0 * area.x * area.y, area.y * area.y) - 0.25 * squares;
        float slack = 1e-4 * (1.0 + dot(abs(squares), vec3(1.0, abs(a.x) + abs(a.y), a.x * a.x + a.y * a.y)));
        thin = least_of(squares, a) < 0.5 + slack || least_of(lesser, a) + 0.0625 < slack;
    }
    s[SHAPE] = vec4(squares, 1.0 / (s[PLACE].w * s[PLACE].w));
    s[AREA] = vec4(area, material.zw);

    vec2 upright = max(r, LEAST_RADIUS);
    vec4 box = vec4(-upright.x, upright.x, -upright.y, upright.y);
    if (!bare) {
        vec2 left = extent(a.x, n.x, n.z, size), right = extent(a.y, n.x, n.z, size), height = extent(b, n.y, n.z, size);
        vec4 seen = vec4(lens.x * min(left.x, right.x), lens.x * max(left.y, right.y), -lens.y * height.yx);
        box = thin ? vec4(min(seen.xz, box.xz), max(seen.yw, box.yw)).xzyw : seen;
    }
    vec2 pad = 0.02 + 1e-4 * (box.yw - box.xz);
    s[BOX] = box + vec4(-pad.x, pad.x, -pad.y, pad.y);

    vec3 reflected, highlight, own = vec3(points[at + 8], points[at + 9], points[at + 10]);
    illuminate(p, -n, vec3(0.0, lens.w, 0.0), material, reflected, highlight);
    s[BACK] = vec4(own * reflected, 0.0);
    illuminate(p, n, vec3(0.0, lens.w, 0.0), material, reflected, highlight);
    s[COLOR] = vec4(own * reflected, 0.0);
#ifndef OWN_EYE
    s[COLOR].rgb += highlight;
#endif
    store(number, s);
}
