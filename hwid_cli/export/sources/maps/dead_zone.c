/* Dead zone: zero between its edges, straight beyond. */
static const double @side@_edges[2] = {@edges@};

static double @side@_map(double v)
{
    return v - fmin(fmax(v, @side@_edges[0]), @side@_edges[1]);
}
