"""Settings of all tests."""

from hypothesis import HealthCheck, Phase, settings

# The same examples in every run, so that a fault found is a fault that can be found again. Random
# drivetrains of dozens of numbers are not worth shrinking: the failing one is printed whole.
settings.register_profile(
    "reproducible",
    deadline=None,
    derandomize=True,
    phases=(Phase.explicit, Phase.generate),
    suppress_health_check=(HealthCheck.too_slow,),
)
settings.load_profile("reproducible")
