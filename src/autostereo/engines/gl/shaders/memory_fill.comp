// Sets all elements of a memory.
layout(local_size_x = 64) in;

layout(r32ui, binding = 0) writeonly uniform uimage2D memory;

uniform uint value;
uniform int rows;

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (at.y < rows) {
        imageStore(memory, at, uvec4(value));
    }
}
