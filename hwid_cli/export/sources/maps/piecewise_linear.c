/* Piecewise linear: the first and last line go on beyond the ends. */
static const double @side@_points[@count@] = {@break_points@};
static const double @side@_values[@count@] = {@values@};

static double @side@_map(double v)
{
    int low = 0, high = @count@ - 1;
    double slope;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (v >= @side@_points[middle]) {
            low = middle;
        } else {
            high = middle;
        }
    }
    slope = @side@_values[low + 1] - @side@_values[low];
    slope /= @side@_points[low + 1] - @side@_points[low];
    return @side@_values[low] + slope * (v - @side@_points[low]);
}
