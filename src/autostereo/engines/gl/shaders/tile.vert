// The rectangles of tiles, nearest of all; every instance is one more view.
#include "lib/frame.glsl"
#include "lib/views.glsl"

uniform int first_view;

flat out int tile;
flat out vec2 origin;   // first column and row of the tile

void main() {
    tile = first_view + gl_InstanceID;
    origin = views[tile].yz;
    vec2 corner = origin + vec2(gl_VertexID & 1, gl_VertexID >> 1) * atlas_size.zw;
    gl_Position = vec4(2.0 * corner / atlas_size.xy - 1.0, -1.0, 1.0);
}
