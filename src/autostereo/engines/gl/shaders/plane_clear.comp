// Before the stages: nothing is seen; all bits set, greater than any depth or number.
#define DEPTHS
#define WINNERS
#include "lib/plane_memory.glsl"

layout(local_size_x = 64) in;

uniform uint count;

void main() {
    uint k = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
    if (k < count) {
        imageStore(depths, place_of(k), uvec4(0xffffffffu));
        imageStore(winners, place_of(k), uvec4(0xffffffffu));
    }
}
