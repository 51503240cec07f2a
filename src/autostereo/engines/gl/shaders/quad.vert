// Covering quads: around the projections of a triangle for all cameras (Huebner 2007b, section 3.2 and 3.5.3; DESIGN
// erratum 2: the least and greatest of both ends of the camera line, after clipping at the near plane).
//
// Four vertices per triangle; vertex k fetches the corners of triangle k/4. With d_k the corners' depths, a ray from the
// eye (v, lens.w, 0) along r = (a, b, 1) has signed volumes e = r.(Qi x Qj) with the edges (i, j), Q seen from that eye:
// all of one sign within the triangle, e/sum(e) the barycentric weights (the linear system of Moeller and Trumbore 1997).
// As 2 Qi x Qj = (Qi + Qj) x (Qj - Qi), small edges keep their digits, and two triangles that share an edge get exactly
// opposite volumes: no gaps. In v they are affine: n + v (0, z, -y), with (x, y, z) twice the edge.
#include "lib/frame.glsl"
#include "lib/views.glsl"
#include "lib/shading.glsl"
#include "lib/surface.glsl"

layout(std430, binding = 0) readonly buffer Vertices { float vertices[]; };
layout(std430, binding = 1) readonly buffer Indices { uint indices[]; };

uniform int tile;        // where the quads go
uniform vec2 reach;      // least and greatest camera offset

flat out vec3 normals[3];     // n of the edge opposite to each corner
flat out vec2 slopes[3];      // (z, -y) of twice that edge
flat out vec3 depths;
flat out Surface corners[3];
flat out ivec2 first_pixel;   // of the tile

const int SIZE =
#ifdef TEXTURED
    11;
#else
    9;
#endif

void include(vec3 p, inout vec2 low, inout vec2 high) {
    vec2 left = picture_times_depth(p, reach.x) / p.z, right = picture_times_depth(p, reach.y) / p.z;
    low = min(low, min(left, right));
    high = max(high, max(left, right));
}

void main() {
    int triangle = gl_VertexID >> 2;
    vec3 p[3];
    for (int k = 0; k < 3; ++k) {
        int at = int(indices[3 * triangle + k]) * SIZE;
        vec3 position = vec3(vertices[at], vertices[at + 1], vertices[at + 2]);
        vec3 normal = vec3(vertices[at + 3], vertices[at + 4], vertices[at + 5]);
        vec3 color = vec3(vertices[at + 6], vertices[at + 7], vertices[at + 8]);
        vec2 uv = vec2(0.0);
#ifdef TEXTURED
        uv = vec2(vertices[at + 9], vertices[at + 10]);
#endif
        p[k] = (eye_from_local * vec4(position, 1.0)).xyz;
        corners[k] = surface_at(p[k], mat3(eye_from_local) * normal, color, uv);
        depths[k] = p[k].z;
    }

    // what is before the near plane is not seen
    float near = depth_range.z;
    vec2 low = vec2(1e30), high = vec2(-1e30);
    for (int k = 0; k < 3; ++k) {
        vec3 a = p[k], b = p[k == 2 ? 0 : k + 1];
        if (a.z >= near) {
            include(a, low, high);
        }
        if ((a.z >= near) != (b.z >= near)) {
            vec3 cut = mix(a, b, (near - a.z) / (b.z - a.z));
            include(vec3(cut.xy, near), low, high);
        }
        vec3 i = b - vec3(0.0, lens.w, 0.0), j = p[k == 0 ? 2 : k - 1] - vec3(0.0, lens.w, 0.0);
        vec3 edge = j - i;
        normals[k] = cross(i + j, edge);
        slopes[k] = 2.0 * vec2(edge.z, -edge.y);
    }

#ifndef TWO_SIDED
    // facing is affine in the camera offset: a triangle that turns its back to both ends turns it to all
    vec3 middle = vec3(0.0, lens.w, 0.0), normal = cross(p[1] - p[0], p[2] - p[0]);
    float facing = dot(p[0] - middle, normal);
    if (facing - reach.x * normal.x <= 0.0 && facing - reach.y * normal.x <= 0.0) {
        high = low;
    }
#endif

    // whole pixels, so that samples anywhere in a pixel are looked at
    low = max(floor(low), vec2(0.0));
    high = min(ceil(high), atlas_size.zw);
    if (any(greaterThanEqual(low, high))) {
        low = high = vec2(0.0);
    }
    first_pixel = ivec2(views[tile].yz);
    vec2 corner = vec2((gl_VertexID & 1) == 0 ? low.x : high.x, (gl_VertexID & 2) == 0 ? low.y : high.y);
    float nearest = max(min(min(p[0].z, p[1].z), p[2].z), near);
    // quad.frag promises depths behind this one: a little nearer, as depths of rays round
    float front = max(window_from_depth(nearest) - 1e-6 * depth_range.x / depth_range.y, 0.0);
    gl_Position = vec4(2.0 * (corner + views[tile].yz) / atlas_size.xy - 1.0, 2.0 * front - 1.0, 1.0);
}
