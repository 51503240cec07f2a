// In which order an invocation changes a triangle's samples of a tile: by the bits of its coverage mask, 16 for each view, or
// channel of a panel.
//
// Switches: PANEL; STAGGER: triangles begin with different views, or channels, so that those that cover a tile at one time
// do not change the same sample (PMR 2020, section 4.3; a panel's tile has its views in its channels).

#ifdef PANEL
const uint PLANES = 3u;
#else
const uint PLANES = 4u;
#endif

// The view, or channel, with which a triangle begins.
uint first_plane(uint number) {
#ifdef STAGGER
    return number % PLANES;
#else
    return 0u;
#endif
}

// The mask turned so that its first bits are that plane's.
uvec2 turned(uvec2 mask, uint plane) {
    mask = (plane & 2u) != 0u ? mask.yx : mask;
    return (plane & 1u) != 0u ? (mask >> 16) | (mask.yx << 16) : mask;
}

// The position of the lowest bit, which is taken away.
int next_bit(inout uvec2 mask) {
    bool low = mask.x != 0u;
    uint word = low ? mask.x : mask.y;
    int bit = findLSB(word);
    word &= word - 1u;
    mask = low ? uvec2(word, mask.y) : uvec2(0u, word);
    return low ? bit : bit + 32;
}

// The same of a mask that was turned: where the bit was before.
int next_turned(inout uvec2 mask, uint plane) {
    return (next_bit(mask) + 16 * int(plane)) & 63;
}
