// Vertices of a part's triangles, from a buffer into memory that is read faster (lib/plane_memory.glsl); once per scene.
#include "lib/invocation.glsl"

layout(local_size_x = 64) in;

layout(std430, binding = 1) readonly buffer Indices { uint indices[]; };
layout(rgba32ui, binding = 1) writeonly uniform uimage2D corners;

uniform int count;

void main() {
    uint k = invocation();
    if (k < uint(count)) {
        uvec4 corner = uvec4(indices[3u * k], indices[3u * k + 1u], indices[3u * k + 2u], 0u);
        imageStore(corners, ivec2(k % MEMORY_WIDTH, k / MEMORY_WIDTH), corner);
    }
}
