// Arrays that are pictures of MEMORY_WIDTH columns: where element i lies. Made by memory.py.
ivec2 place_of(uint i) {
    return ivec2(i % MEMORY_WIDTH, i / MEMORY_WIDTH);
}
