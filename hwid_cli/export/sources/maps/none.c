static double @side@_map(double v)
{
    return v;
}
