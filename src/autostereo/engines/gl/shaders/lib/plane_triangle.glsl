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
    vec4 corner[3];  // x at offset 0 and y, in pixels, snapped; x's change per camera offset; window depth. Fronts: clockwise
    uvec4 info;      // number in the scene; bits 0-2: edge is walked backwards, 3: two-sided; first row, last row
};

const uint BOTH_SIDES = 8u;

struct Edge {
    vec3 start;   // x, y, p
    vec3 step;    // to the other end; backwards edges: of both signs changed, so that E is what it is forwards
    float slope;  // dE/dx = yA - yB
};

#ifdef PLANAR
uniform float first_offset;  // of view 0, whose slope the planes have
#endif

Edge edge_of(Triangle t, int k) {
    vec3 a = t.corner[(k + 1) % 3].xyz, b = t.corner[(k + 2) % 3].xyz;
    precise vec3 step = b - a;  // exactly opposite if walked backwards, and so is E
    return Edge(((t.info.y >> k) & 1u) != 0u ? b : a, step, -step.y);
}

// Where an edge is in view v: column of its start; dE/dy.
vec2 edge_in_view(Edge e, float v) {
    precise float column = e.start.x + v * e.start.z;
#ifdef PLANAR
    precise float width = e.step.x + first_offset * e.step.z;
#else
    precise float width = e.step.x + v * e.step.z;
#endif
    return vec2(column, width);
}

// The two terms of E at (x, y) in a view.
vec2 terms(Edge e, vec2 here, float x, float y) {
    precise vec2 part = vec2(e.slope * (x - here.x), here.y * (y - e.start.y));
    return part;
}

// Whether a sample at E = 0 belongs to the front that lies to the right or below: top-left rule, as engines/reference/mesh.py.
bool keeps(Edge e, vec2 here) {
    return e.slope > 0.0 || (e.slope == 0.0 && here.y > 0.0);
}

// Whether (x, y) is on the inner side of a front's edge; else it is on the inner side of a back's.
bool before(Edge e, vec2 here, float x, float y) {
    precise vec2 part = terms(e, here, x, y);
    precise float value = part.x + part.y;
    return keeps(e, here) ? value >= 0.0 : value > 0.0;
}

// The same of the columns x as bits.
uint columns_before(Edge e, vec2 here, vec4 x, float y) {
    precise float down = here.y * (y - e.start.y);
    precise vec4 across = e.slope * (x - here.x);
    precise vec4 value = across + down;
    uvec4 bits = uvec4(keeps(e, here) ? greaterThanEqual(value, vec4(0.0)) : greaterThan(value, vec4(0.0)));
    return bits.x | bits.y << 1 | bits.z << 2 | bits.w << 3;
}

// Twice the area in view v, positive for fronts: S0 + v S1.
float area_of(Triangle t, float v) {
    vec3 x = vec3(t.corner[0].x, t.corner[1].x, t.corner[2].x) + v * vec3(t.corner[0].z, t.corner[1].z, t.corner[2].z);
    return (x.y - x.x) * (t.corner[2].y - t.corner[0].y) - (x.z - x.x) * (t.corner[1].y - t.corner[0].y);
}
