// One number for each ray of a fragment: LANES is 1, or 3 for the sub-pixels of a pixel.

#if LANES == 3
#define LANE vec3
float least(vec3 a) { return min(a.x, min(a.y, a.z)); }
float greatest(vec3 a) { return max(a.x, max(a.y, a.z)); }
bool every(bvec3 a) { return all(a); }
bvec3 less(vec3 a, vec3 b) { return lessThan(a, b); }
bvec3 same(vec3 a, vec3 b) { return equal(a, b); }
bvec3 not_less(vec3 a, vec3 b) { return greaterThanEqual(a, b); }
float of(vec3 a, int l) { return l == 0 ? a.x : l == 1 ? a.y : a.z; }
vec3 with(vec3 a, int l, float x) { return mix(a, vec3(x), equal(ivec3(l), ivec3(0, 1, 2))); }
vec3 choose(bvec3 which, vec3 a, vec3 b) { return mix(b, a, which); }
#else
#define LANE float
float least(float a) { return a; }
float greatest(float a) { return a; }
bool every(bool a) { return a; }
bool less(float a, float b) { return a < b; }
bool same(float a, float b) { return a == b; }
bool not_less(float a, float b) { return a >= b; }
float of(float a, int l) { return a; }
float with(float a, int l, float x) { return x; }
float choose(bool which, float a, float b) { return which ? a : b; }
#endif
