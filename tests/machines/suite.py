"""The frozen list of machines.

A builder gives the machine of its name for one of the two sets of seeds. Sizes are of
machines one can buy or has measured: coils of a gram, stages, presses, gantries of two
tons, spindles and arms.
"""

from collections.abc import Callable

from tests.machines import hidden as h
from tests.machines.bench import Draw
from tests.machines.machine import Answers, Machine

Builder = Callable[[Draw], Machine]
SUITE: dict[str, tuple[str, Builder]] = {}


def machine(family: str) -> Callable[[Builder], Builder]:
    """Put a builder on the list under its own name."""

    def listed(build: Builder) -> Builder:
        SUITE[build.__name__] = (family, build)
        return build

    return listed


def built(name: str, seeds: str) -> Machine:
    """The machine of a name in one of the two sets of seeds."""
    family, build = SUITE[name]
    made = build(Draw(name, seeds))
    made.family = family
    return made


# Friction


@machine("friction")
def voice_coil_coulomb(draw):
    b = draw.bench(
        "steps sine triangles",
        mass=1.2e-3,
        pace=35.0,
        damping=0.15,
        force_constant=0.8,
        top=0.25,
        sample_s=2e-4,
        samples=1500,
        count=9,
    )
    return b.machine(
        "voice coil on leaf springs that rubs", [h.coulomb(0.04 * b.force)]
    )


@machine("friction")
def gantry_coulomb(draw):
    b = draw.bench(
        "doublets levels steps",
        mass=1800.0,
        pace=0.4,
        damping=0.12,
        force_constant=140.0,
        top=12.0,
        sample_s=5e-3,
        samples=1600,
        count=8,
        free=True,
    )
    return b.machine("gantry on rails", [h.coulomb(0.08 * b.force)], noise=0.001)


@machine("friction")
def wheel_coulomb_servo(draw):
    b = draw.servo(
        "moves sine triangles",
        mass=2e-3,
        damping_time_s=0.8,
        force_constant=0.06,
        travel=3.0,
        bandwidth=6.0,
        sample_s=1e-3,
    )
    return b.machine(
        "wheel under position control",
        [h.coulomb(0.08 * b.force)],
        noise=0.0005,
        output_unit=("angle_rad", 1.0),
    )


@machine("friction")
def stage_lugre(draw):
    b = draw.bench(
        "triangles sine steps multisine",
        mass=0.8,
        pace=8.0,
        damping=0.1,
        force_constant=6.0,
        top=2.0,
        sample_s=1e-3,
        samples=1500,
        count=10,
    )
    force = draw.near(0.06 * b.force)
    lugre = h.lugre(force, 1.5 * force, 0.02 * b.speed, 0.004 * b.travel, b.base.mass)
    friction = ["hysteresis", "stribeck_friction", "coulomb_friction"]
    answers = Answers(
        near=[[one] for one in friction] + [["hysteresis", "stribeck_friction"]]
    )
    return b.machine("stage on roller guides", [lugre], answers=answers, cells=40)


@machine("friction")
def flexure_maxwell_slip(draw):
    b = draw.bench(
        "triangles sine staircase",
        mass=0.05,
        pace=60.0,
        damping=0.08,
        force_constant=1.5,
        top=1.0,
        sample_s=1e-4,
        samples=2000,
        count=8,
    )
    friction = h.maxwell_slip(0.08 * b.force, 0.05 * b.travel, 6)
    answers = Answers(
        near=[["hysteresis"], ["hysteresis", "hysteresis"]],
        partial=[["coulomb_friction"]],
    )
    return b.machine(
        "clamped flexure that slips bit by bit",
        [friction],
        answers=answers,
        noise=0.002,
    )


@machine("friction")
def stribeck_other_exponent(draw):
    b = draw.bench(
        "triangles sine steps",
        mass=5.0,
        pace=3.0,
        damping=0.1,
        force_constant=12.0,
        top=5.0,
        sample_s=2e-3,
        samples=1500,
        count=9,
    )
    force = draw.near(0.04 * b.force)
    friction = h.stribeck(force, 0.8 * force, 0.05 * b.speed, exponent=1.0)
    answers = Answers(near=[["stribeck_friction"]], partial=[["coulomb_friction"]])
    return b.machine("slideway with oil", [friction], answers=answers)


@machine("friction")
def slideway_stribeck(draw):
    b = draw.bench(
        "triangles sine steps",
        mass=60.0,
        pace=2.0,
        damping=0.08,
        force_constant=40.0,
        top=10.0,
        sample_s=4e-3,
        samples=1400,
        count=9,
    )
    force = draw.near(0.05 * b.force)
    friction = h.stribeck(force, draw.near(0.7 * force), draw.near(0.05 * b.speed))
    answers = Answers(full=[["stribeck_friction"]], partial=[["coulomb_friction"]])
    return b.machine("slideway that sticks", [friction], answers=answers)


@machine("friction")
def cylinder_asymmetric(draw):
    b = draw.bench(
        "triangles sine steps",
        mass=14.0,
        pace=2.5,
        damping=0.1,
        force_constant=25.0,
        top=8.0,
        sample_s=4e-3,
        samples=1000,
        count=8,
    )
    friction = h.asymmetric(draw.near(0.09 * b.force), draw.near(0.04 * b.force))
    answers = Answers(
        full=[["asymmetric_friction"], ["coulomb_friction", "constant_load"]],
        partial=[["coulomb_friction"]],
    )
    return b.machine("seal with a lip to one side", [friction], answers=answers)


@machine("friction")
def worm_gear(draw):
    b = draw.bench(
        "doublets levels steps",
        mass=0.02,
        pace=4.0,
        damping=0.15,
        force_constant=0.3,
        top=3.0,
        sample_s=1e-3,
        samples=1500,
        count=10,
        free=True,
    )
    friction = h.worm(draw.near(0.02 * b.force), draw.near(0.25))
    answers = Answers(
        full=[["load_friction"]],
        partial=[["coulomb_friction"], ["asymmetric_friction"]],
    )
    return b.machine(
        "worm gear, whose teeth rub with the load",
        [friction],
        answers=answers,
        output_unit=("angle_rad", 1.0),
        noise=0.001,
    )


@machine("friction")
def wedge_clutch(draw):
    b = draw.bench(
        "triangles staircase sine",
        mass=2.2,
        pace=4.0,
        damping=0.12,
        force_constant=20.0,
        top=4.0,
        sample_s=2e-3,
        samples=1500,
        count=9,
    )
    friction = h.wedge(draw.near(0.015 * b.force), draw.near(0.12))
    answers = Answers(full=[["load_friction"]], partial=[["coulomb_friction"]])
    return b.machine("spring that presses its own guide", [friction], answers=answers)


@machine("friction")
def belt_uneven_way(draw):
    b = draw.servo(
        "moves sine triangles",
        mass=6.0,
        damping_time_s=0.7,
        force_constant=15.0,
        travel=0.35,
        bandwidth=4.0,
        sample_s=2e-3,
        samples=2000,
    )
    friction = h.uneven_way(0.1 * b.force, draw.near(0.5), 0.6 * b.travel, draw.angle())
    answers = Answers(full=[["position_friction"]], partial=[["coulomb_friction"]])
    return b.machine(
        "belt axis with a tight place", [friction], answers=answers, noise=0.0005
    )


@machine("friction")
def cylinder_held(draw):
    b = draw.bench(
        "steps triangles sine",
        mass=300.0,
        pace=1.5,
        damping=0.12,
        force_constant=220.0,
        top=9.0,
        sample_s=5e-3,
        samples=1200,
        count=8,
    )
    force = draw.near(0.07 * b.force)
    held = draw.rng.uniform(-0.7, 0.7, b.count) * force / b.base.stiffness
    return b.machine(
        "press that stays wherever its seal holds it",
        [h.coulomb(force)],
        held_at=held,
        settings={"initial_state": "held"},
        noise=0.002,
    )


@machine("friction")
def bearing_dahl(draw):
    b = draw.bench(
        "triangles sine steps",
        mass=4e-4,
        pace=12.0,
        damping=0.08,
        force_constant=0.02,
        top=0.6,
        sample_s=5e-4,
        samples=1600,
        count=9,
    )
    friction = h.dahl(draw.near(0.07 * b.force), draw.near(0.03 * b.travel))
    answers = Answers(full=[["hysteresis"]], partial=[["coulomb_friction"]])
    return b.machine(
        "pivot bearing of a small mirror",
        [friction],
        answers=answers,
        output_unit=("angle_rad", 1.0),
    )


@machine("friction")
def fan_drag(draw):
    b = draw.bench(
        "levels steps doublets",
        mass=8e-3,
        pace=1.0,
        damping=0.08,
        force_constant=0.09,
        top=4.0,
        sample_s=5e-3,
        samples=1500,
        count=8,
        free=True,
    )
    return b.machine(
        "fan in air",
        [h.drag(draw.near(0.5 * b.force / b.speed**2))],
        noise=0.001,
        output_unit=("angle_rad", 1.0),
    )


# Springs, contacts and loads


@machine("springs")
def press_hunt_crossley(draw):
    b = draw.bench(
        "steps sine staircase chirp",
        mass=25.0,
        pace=3.0,
        damping=0.1,
        force_constant=60.0,
        top=10.0,
        sample_s=2e-3,
        samples=1500,
        count=9,
    )
    at = draw.near(0.45 * b.travel)
    contact = h.hunt_crossley(
        at, 6.0 * b.force / (0.2 * b.travel) ** 1.5, 0.3 / b.speed
    )
    answers = Answers(near=[["one_sided_stop"]])
    return b.machine("press that meets a ball", [contact], answers=answers)


@machine("springs")
def carriage_unequal_stops(draw):
    b = draw.bench(
        "steps sine chirp levels",
        mass=0.3,
        pace=5.0,
        damping=0.08,
        force_constant=4.0,
        top=3.0,
        sample_s=2e-3,
        samples=1200,
        count=10,
    )
    stiff = 8.0 * b.base.stiffness
    pair = [
        h.stop(0.5 * b.travel, stiff),
        h.stop(-draw.near(0.32 * b.travel), 2.0 * stiff),
    ]
    answers = Answers(
        full=[["one_sided_stop", "one_sided_stop"]],
        partial=[["one_sided_stop"], ["end_stop"], ["end_stop", "one_sided_stop"]],
    )
    return b.machine("carriage between unequal buffers", pair, answers=answers)


@machine("springs")
def drum_sinh_spring(draw):
    b = draw.bench(
        "sine steps multisine",
        mass=0.012,
        pace=40.0,
        damping=0.06,
        force_constant=3.0,
        top=1.5,
        sample_s=2e-4,
        samples=2000,
        count=8,
    )
    answers = Answers(near=[["cubic_stiffness"]], partial=[["end_stop"]])
    spring = h.sinh_spring(b.base.stiffness, draw.near(2.2) / b.travel)
    return b.machine("loudspeaker's rim", [spring], answers=answers)


@machine("springs")
def valve_clearance(draw):
    b = draw.bench(
        "steps sine staircase triangles",
        mass=0.9,
        pace=6.0,
        damping=0.15,
        force_constant=11.0,
        top=5.0,
        sample_s=1e-3,
        samples=1500,
        count=9,
    )
    spring = h.clearance(draw.near(0.06 * b.travel), b.base.stiffness)
    return b.machine("valve whose spring has play", [spring])


@machine("springs")
def pedal_preload(draw):
    b = draw.bench(
        "triangles sine staircase steps",
        mass=1.5,
        pace=4.0,
        damping=0.25,
        force_constant=9.0,
        top=6.0,
        sample_s=2e-3,
        samples=1200,
        count=9,
    )
    spring = h.preload(draw.near(0.15 * b.force), 2e-3 * b.travel)
    answers = Answers(full=[["spring_preload"]])
    return b.machine(
        "pedal between two set springs", [spring], answers=answers, cells=60
    )


@machine("springs")
def hanging_arm(draw):
    b = draw.bench(
        "doublets levels steps",
        mass=0.15,
        pace=0.9,
        damping=0.1,
        force_constant=0.8,
        top=2.0,
        sample_s=5e-3,
        samples=1500,
        count=8,
        free=True,
    )
    arm = h.unbalance(draw.near(0.8 * b.force), 0.0)
    return b.machine("arm that hangs", [arm], output_unit=("angle_rad", 1.0))


@machine("springs")
def leaning_arm(draw):
    b = draw.bench(
        "steps sine triangles levels",
        mass=0.6,
        pace=1.2,
        damping=0.12,
        force_constant=5.0,
        top=6.0,
        sample_s=5e-3,
        samples=1200,
        count=9,
    )
    arm = h.unbalance(draw.near(0.5 * b.force), draw.near(0.7))
    return b.machine(
        "arm on a torsion spring, at an angle", [arm], output_unit=("angle_rad", 1.0)
    )


# Nothing is missing


@machine("clean")
def clean_exact(draw):
    b = draw.bench(
        "sine steps levels",
        mass=3.0,
        pace=4.0,
        damping=0.1,
        force_constant=10.0,
        top=4.0,
        sample_s=2e-3,
        samples=1200,
        count=8,
    )
    return b.machine("stage, simulation exactly right", exact=True)


@machine("clean")
def clean_voice_coil(draw):
    b = draw.bench(
        "steps one_way chirp",
        mass=1e-3,
        pace=50.0,
        damping=0.3,
        force_constant=1.1,
        top=0.2,
        sample_s=1e-4,
        samples=2000,
        count=7,
    )
    return b.machine("voice coil of a gram", noise=0.01)


@machine("clean")
def clean_gantry(draw):
    b = draw.bench(
        "doublets levels",
        mass=2000.0,
        pace=0.3,
        damping=0.15,
        force_constant=160.0,
        top=15.0,
        sample_s=1e-2,
        samples=1200,
        count=8,
        free=True,
    )
    return b.machine("air-guided gantry of two tons", noise=0.0005)
