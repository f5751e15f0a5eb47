/* Piecewise constant: levels between edges and beyond them. */
static const double @side@_edges[@count@] = {@edges@};
static const double @side@_levels[@count@ + 1] = {@levels@};

static double @side@_map(double v)
{
    int low = 0, high = @count@;
    while (low < high) {
        const int middle = (low + high) / 2;
        if (v >= @side@_edges[middle]) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return @side@_levels[low];
}
