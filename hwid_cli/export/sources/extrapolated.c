/* The law holds where the data of the fit were, straight lines elsewhere. */
static const double @side@_visited[2 * @count@] = {@visited@};

static double @side@_map(double v)
{
    int i;
    for (i = 0; i < @count@; ++i) {
        if (v >= @side@_visited[2 * i] && v <= @side@_visited[2 * i + 1]) {
            return @side@_law(v);
        }
    }
    return @side@_beyond_map(v);
}
