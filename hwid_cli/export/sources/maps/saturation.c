/* Saturation: straight between its limits, constant beyond. */
static const double @side@_limits[2] = {@limits@};

static double @side@_map(double v)
{
    return fmin(fmax(v, @side@_limits[0]), @side@_limits[1]);
}
