// Adds a picture's samples, as whole numbers 0 ... 255, to a sum.
uniform sampler2D picture;
out vec4 sum;
void main() {
    sum = LEVELS * texelFetch(picture, ivec2(gl_FragCoord.xy), 0);
}
