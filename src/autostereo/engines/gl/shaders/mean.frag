// Mean of summed samples, rounded half up.
uniform sampler2D sums;
uniform float count;
out vec4 color;
void main() {
    vec4 sum = floor(texelFetch(sums, ivec2(gl_FragCoord.xy), 0) + 0.5);
    color = floor((sum + floor(count / 2.0)) / count) / LEVELS;
}
