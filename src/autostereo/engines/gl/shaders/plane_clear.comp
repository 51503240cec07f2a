// Before the stages: nothing is seen; all bits set, greater than any depth or number.
#define DEPTHS
#define WINNERS
#include "lib/plane_memory.glsl"
#include "lib/invocation.glsl"

layout(local_size_x = 64) in;

uniform uint count;

void main() {
    uint k = invocation();
    if (k < count) {
        imageStore(depths, place_of(k), uvec4(0xffffffffu));
        imageStore(winners, place_of(k), uvec4(0xffffffffu));
    }
}
