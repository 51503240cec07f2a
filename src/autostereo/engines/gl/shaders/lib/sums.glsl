// What samples have of surfels: the bits of the least depth; sums of weights and of weighted colours as whole numbers of 64
// bits, steps of 1/UNIT, so that their order does not matter: low words, and high words for what these carry over. A sample
// of a panel has a colour and a weight, one of a view three colours and a weight. Needs memory.glsl. Made by points_splat.py.

layout(r32ui, binding = 1) uniform uimage2D nearest;
#ifndef NEAREST
layout(r32ui, binding = 2) uniform uimage2D low_words;
layout(r32ui, binding = 3) uniform uimage2D high_words;
#endif

#ifdef PANEL
const uint VALUES = 2u;
#else
const uint VALUES = 4u;
#endif
const float UNIT = 16777216.0;  // weights are at most 1
const uint NOTHING = 0xffffffffu;

#ifndef NEAREST
float total(uint k) {
    return float(imageLoad(high_words, place_of(k)).x) * 4294967296.0 + float(imageLoad(low_words, place_of(k)).x);
}
#endif
