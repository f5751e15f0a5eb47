"""The same fit with jax-sysid, imported only where it is installed.

A state-space model between two piecewise linear maps of ten fixed knots, 1000 iterations
of Adam and 1000 of L-BFGS from one seed.
"""

import numpy as np

KNOTS = 10


def straight_lines(jnp, v, knots, values):
    """Straight lines between and beyond knots."""
    at = jnp.clip(jnp.searchsorted(knots, v) - 1, 0, KNOTS - 2)
    share = (v - knots[at]) / (knots[at + 1] - knots[at])
    return values[at] + share * (values[at + 1] - values[at])


def functions(u):
    """State and output functions for scaled inputs, and the knots of both maps."""
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_platform_name", "cpu")
    jax.config.update("jax_enable_x64", True)
    jax.clear_caches()
    p = jnp.linspace(float(u.min()), float(u.max()), KNOTS)
    q = jnp.linspace(-3.0, 3.0, KNOTS)

    def state(x, v, k):
        return k[0] @ x + k[1] @ straight_lines(jnp, v, p, k[3])

    def output(x, v, k):
        return straight_lines(jnp, k[2] @ x, q, k[4])

    return jax.jit(state), jax.jit(output), np.array(p), np.array(q)


def by_jax_sysid(orders, u, y, u_test):
    """Output of a model with as many states as the plant has poles."""
    from jax_sysid.models import Model
    from jax_sysid.utils import standard_scale, unscale

    n = orders.nf
    outputs, y_mean, y_gain = standard_scale(y[:, None])
    inputs, u_mean, u_gain = standard_scale(u[:, None])
    state, output, p, q = functions(inputs)
    model = Model(n, 1, 1, state_fcn=state, output_fcn=output)
    rng = np.random.default_rng(0)
    block = 0.8 * np.eye(n) + 0.1 * rng.standard_normal((n, n))
    gains = 0.1 * rng.standard_normal((n, 1)), 0.3 * rng.standard_normal((1, n))
    model.init(params=[block, *gains, p, q])
    model.loss(rho_x0=1e-6, rho_th=1e-8, train_x0=False)
    model.optimization(adam_epochs=1000, lbfgs_epochs=1000, iprint=-1)
    model.fit(outputs, inputs)
    found = model.predict(np.zeros(n), (u_test[:, None] - u_mean) * u_gain)[0]
    return np.nan_to_num(np.asarray(unscale(found, y_mean, y_gain))[:, 0], nan=1e9)
