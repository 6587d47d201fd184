"""Forecasters that are fitted without gradients, by name: what any twin is compared with."""

from collections.abc import Callable

from odisar.forecasters.constant_velocity import ConstantVelocity
from odisar.forecasters.direct_linear import DirectLinear
from odisar.forecasters.interface import Forecaster
from odisar.forecasters.persistence import Persistence
from odisar.windows.scaling import Scaler
from odisar.windows.windowing import WindowSpec

#: What validation windows choose from; no lag reaches beyond the context.
_LAGS_STEPS, _PENALTIES = (10, 30, 60), (1e-6, 1e-4, 1e-2, 1.0)
_SLOPE_STEPS, _DAMPINGS = (1, 3, 5, 10), (0.0, 0.5, 0.8, 0.9, 0.95, 0.98)


def cheap_forecasters(
    scaler: Scaler, spec: WindowSpec, rate_hz: float
) -> dict[str, Callable[[], Forecaster]]:
    """Return what makes each forecaster, by name."""
    lags = sorted({min(steps, spec.context_steps) for steps in _LAGS_STEPS})
    slopes = sorted({min(steps, spec.context_steps - 1) for steps in _SLOPE_STEPS})
    return {
        "persistence": lambda: Persistence(scaler, spec),
        "constant-velocity": lambda: ConstantVelocity(scaler, spec, rate_hz, slopes, _DAMPINGS),
        "closed-form": lambda: DirectLinear(scaler, spec, lags, _PENALTIES),
    }
