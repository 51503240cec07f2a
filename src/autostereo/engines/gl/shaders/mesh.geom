// Makes of one triangle as many as there are views (de Sorbier 2008, section 4.1), each in its view's tile.
//
// The paper sends each view to a render target of its own, which share one depth buffer; tiles of one texture have true
// depth, and their number is not that of the targets (its section 3.2, first of the two solutions). With PAINTER it is
// done as the paper does: to a target chosen in the fragment shader, without a depth test.
#include "lib/frame.glsl"
#include "lib/views.glsl"
#include "lib/shading.glsl"
#include "lib/surface.glsl"

layout(triangles) in;
layout(triangle_strip, max_vertices = MAX_VERTICES) out;

uniform int first_view;  // tile of the first copy
uniform int copies;      // at most MAX_VERTICES / 3

in Vertex {
    Surface surface;
} corner[];

out Vertex {
    Surface surface;
} vertex;
flat out float camera_offset;
#ifdef PAINTER
flat out int target;
#endif

void main() {
    for (int copy = 0; copy < copies; ++copy) {
        vec4 view = views[first_view + copy];
        for (int k = 0; k < 3; ++k) {
            vertex.surface = corner[k].surface;
            camera_offset = view.x;
            vec4 sides;
            gl_Position = clip_in_tile(gl_in[k].gl_Position.xyz, view, sides);
#ifdef PAINTER
            target = copy;
#else
            gl_ClipDistance[0] = sides.x;
            gl_ClipDistance[1] = sides.y;
            gl_ClipDistance[2] = sides.z;
            gl_ClipDistance[3] = sides.w;
#endif
            EmitVertex();
        }
        EndPrimitive();
    }
}
