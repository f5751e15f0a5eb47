/* Polynomial: Chebyshev coefficients over its domain, by Clenshaw's recursion. */
static const double @side@_chebyshev[@count@] = {@chebyshev@};
static const double @side@_domain[2] = {@domain@};

static double @side@_map(double v)
{
    const double low = @side@_domain[0], high = @side@_domain[1];
    const double s = (2.0 * v - low - high) / (high - low);
    double now = @side@_chebyshev[0], ahead = 0.0;
    int i;
    if (@count@ > 1) {
        now = @side@_chebyshev[(@count@ + @count@ - 2) % @count@];
        ahead = @side@_chebyshev[@count@ - 1];
    }
    for (i = @count@ - 3; i >= 0; --i) {
        const double before = now;
        now = @side@_chebyshev[i] - ahead;
        ahead = before + ahead * (2.0 * s);
    }
    return now + ahead * s;
}
