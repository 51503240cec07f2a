// Panels whose columns are drawn in another order: of RUN periods of the display's table those next to each other that show
// the same views. Devices carry out neighbouring fragments together, which then go the same way.

const int RUN = 4;   // columns: devices shade blocks of as many, or of twice as many
uniform int period;  // columns of the table

// First column of the RUN periods that hold one.
int start_of(int column) {
    return column / (RUN * period) * (RUN * period);
}

// The column that is drawn in the place of another; where the panel's end cuts periods, itself.
int shown_at(int place, int width) {
    int first = start_of(place), x = place - first;
    return first + RUN * period > width ? place : first + x % RUN * period + x / RUN;
}

// The place where a column is drawn.
int drawn_at(int column, int width) {
    int first = start_of(column), x = column - first;
    return first + RUN * period > width ? column : first + x % period * RUN + x / period;
}
