// A triangle in all views at once (PMR 2020, section 3): its side faces, and its depth.
//
// Rows from the top. In the view of camera offset v a corner (x, y, p) is at (x + v p, y). The side face of edge AB is
//     E(x, y, v) = (yA - yB) (x - xA - v pA) + (xB - xA + v (pB - pA)) (y - yA),
// a ruled surface, affine in each of x, y and v by itself, so that over a box it is least and greatest at corners. The
// paper's section 3.2 takes a plane for it (PLANAR: through A0, B0 and A's path), which it is only if pA = pB: DESIGN
// section 2, erratum 1. Both triangles at an edge walk it from the same corner, so that their values are exactly opposite: a
// sample on a shared edge belongs to one of them.
//
// Switch: PLANAR.

struct Triangle {
    vec4 corner[3];  // x at offset 0 and y, in pixels, snapped; x's change per camera offset; 1/depth. Fronts: clockwise
    uvec4 info;      // number in the scene; bits 0-2: edge is walked backwards, 3: two-sided; first row, last row
};

const uint BOTH_SIDES = 8u;

struct Edge {
    vec3 start;   // x, y, p
    vec3 step;    // to the other end
    float turn;   // -1: walked backwards
};

#ifdef PLANAR
uniform float first_offset;  // of view 0, whose slope the planes have
#endif

Edge edge_of(Triangle t, int k) {
    vec3 a = t.corner[(k + 1) % 3].xyz, b = t.corner[(k + 2) % 3].xyz;
    bool back = ((t.info.y >> k) & 1u) != 0u;
    precise vec3 step = back ? a - b : b - a;
    return Edge(back ? b : a, step, back ? -1.0 : 1.0);
}

float width_of(Edge e, float v) {
#ifdef PLANAR
    precise float width = e.step.x + first_offset * e.step.z;
#else
    precise float width = e.step.x + v * e.step.z;
#endif
    return width;
}

// The two terms of E at (x, y, v).
vec2 terms(Edge e, float x, float y, float v) {
    precise float across = -e.step.y * (x - (e.start.x + v * e.start.z));
    precise float down = width_of(e, v) * (y - e.start.y);
    return e.turn * vec2(across, down);
}

// Which of the columns x, row y, are on the inner side (+1: of a front, -1: of a back) of an edge in view v: top-left rule,
// as engines/reference/mesh.py.
bvec4 inside(Edge e, float side, vec4 x, float y, float v) {
    float facing = side * e.turn;
    precise float along = e.start.x + v * e.start.z;
    precise float width = width_of(e, v);
    precise float down = width * (y - e.start.y);
    precise vec4 value = facing * (-e.step.y * (x - along) + down);
    bool kept = -facing * e.step.y > 0.0 || (e.step.y == 0.0 && facing * width > 0.0);
    return kept ? greaterThanEqual(value, vec4(0.0)) : greaterThan(value, vec4(0.0));
}

const uvec4 COLUMN_BITS = uvec4(1, 2, 4, 8);

// Bits of the columns x, row y, that a triangle covers in view v.
uint covered(Edge e[3], bool both, vec4 x, float y, float v) {
    uint front = 15u, back = both ? 15u : 0u;
    for (int k = 0; k < 3; ++k) {
        uvec4 bits = uvec4(inside(e[k], 1.0, x, y, v)) * COLUMN_BITS;
        front &= bits.x | bits.y | bits.z | bits.w;
    }
    if (both) {
        for (int k = 0; k < 3; ++k) {
            uvec4 bits = uvec4(inside(e[k], -1.0, x, y, v)) * COLUMN_BITS;
            back &= bits.x | bits.y | bits.z | bits.w;
        }
    }
    return front | back;
}

// Twice the area in view v, positive for fronts: S0 + v S1.
float area_of(Triangle t, float v) {
    vec3 x = vec3(t.corner[0].x, t.corner[1].x, t.corner[2].x) + v * vec3(t.corner[0].z, t.corner[1].z, t.corner[2].z);
    return (x.y - x.x) * (t.corner[2].y - t.corner[0].y) - (x.z - x.x) * (t.corner[1].y - t.corner[0].y);
}
