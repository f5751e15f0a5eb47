/* Sigmoid network: a straight line and smooth steps. */
static const double @side@_centres[@count@] = {@centres@};
static const double @side@_widths[@count@] = {@widths@};
static const double @side@_heights[@count@] = {@heights@};
static const double @side@_line[2] = {@line@};
static const double @side@_domain[2] = {@domain@};

static double @side@_map(double v)
{
    const double low = @side@_domain[0], high = @side@_domain[1];
    double value = 0.0;
    int i;
    for (i = 0; i < @count@; ++i) {
        const double s = (v - @side@_centres[i]) / @side@_widths[i];
        value += @side@_heights[i] * 0.5 * tanh(0.5 * s);
    }
    return @side@_line[0]
        + (@side@_line[1] - @side@_line[0]) / (high - low) * (v - low) + value;
}
