"""The frozen list of machines.

A builder gives the machine of its name for one of the sets of seeds. Sizes are of
machines one can buy or has measured: coils of a gram, stages, presses, gantries of two
tons, spindles and arms.
"""

from collections.abc import Callable

import numpy as np

from tests.machines import hidden as h
from tests.machines.bench import Draw, own_names
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
    """The machine of a name in one of the sets of seeds."""
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


def _gantry(draw):
    return draw.bench(
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


@machine("friction")
def gantry_coulomb(draw):
    b = _gantry(draw)
    return b.machine("gantry on rails", [h.coulomb(0.08 * b.force)], noise=0.001)


def _wheel(draw):
    return draw.servo(
        "moves sine triangles",
        mass=2e-3,
        damping_time_s=0.8,
        force_constant=0.06,
        travel=3.0,
        bandwidth=6.0,
        sample_s=1e-3,
    )


@machine("friction")
def wheel_coulomb_servo(draw):
    b = _wheel(draw)
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
    # Bristles are an entry of the hysteresis: with them it may be all.
    answers = Answers(
        full=[["hysteresis"]],
        near=[[one] for one in friction] + [["hysteresis", "stribeck_friction"]],
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
    at = draw.near(0.55 * b.usual)
    contact = h.hunt_crossley(at, 6.0 * b.force / (0.2 * b.usual) ** 1.5, 0.3 / b.speed)
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
        h.stop(0.7 * b.usual, stiff),
        h.stop(-draw.near(0.5 * b.usual), 2.0 * stiff),
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
        "pedal between two set springs", [spring], answers=answers, cells=16
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
    # A wave along the way of 2 pi is the same law.
    answers = Answers(full=[["gravity"]], near=[["cogging"]])
    return b.machine(
        "arm that hangs", [arm], answers=answers, output_unit=("angle_rad", 1.0)
    )


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
    # Cosine and sine of the angle as a series: a load, and springs of higher order.
    series = ["constant_load", "quadratic_stiffness", "cubic_stiffness"]
    answers = Answers(
        full=[["gravity"]],
        near=[series, series[:2], [series[0], series[2]], ["cogging", "constant_load"]],
        partial=[["constant_load"]],
    )
    return b.machine(
        "arm on a torsion spring, at an angle",
        [arm],
        answers=answers,
        output_unit=("angle_rad", 1.0),
    )


@machine("springs")
def reluctance_magnet(draw):
    b = draw.bench(
        "sine steps levels",
        mass=0.1,
        pace=15.0,
        damping=0.12,
        force_constant=8.0,
        top=1.0,
        sample_s=5e-4,
        samples=1500,
        count=9,
    )
    bias, gap = 1.5 * b.top, 6.0 * b.travel
    magnet = h.reluctance(bias, gap, b.base.force_constant * gap**2 / (2.0 * bias))
    kin = ["supply_sag", "quadratic_stiffness", "sensor_quadratic"]
    answers = Answers(partial=[["quadratic_stiffness"], kin[:2]], honest_refusal=True)
    return b.machine("magnet that pulls an armature", [magnet], answers=answers)


@machine("springs")
def speaker_cubic(draw):
    b = draw.bench(
        "chirp multisine sine",
        mass=8e-3,
        pace=55.0,
        damping=0.15,
        force_constant=5.0,
        top=1.2,
        sample_s=1e-4,
        samples=3000,
        count=6,
    )
    spring = h.cubic(draw.near(0.6) * b.base.stiffness / b.travel**2)
    return b.machine(
        "loudspeaker",
        [spring],
        input_unit=("current_mA", 1e3),
        output_unit=("position_mm", 1e3),
    )


@machine("springs")
def slide_stops(draw):
    b = draw.bench(
        "steps sine triangles chirp",
        mass=40.0,
        pace=2.0,
        damping=0.1,
        force_constant=50.0,
        top=20.0,
        sample_s=4e-3,
        samples=1200,
        count=9,
    )
    buffers = h.stops(draw.near(0.7 * b.usual), draw.near(12.0 * b.base.stiffness))
    return b.machine("slide between rubber buffers", [buffers])


@machine("springs")
def disc_softer_side(draw):
    b = draw.bench(
        "steps sine triangles levels",
        mass=3e-5,
        pace=80.0,
        damping=0.1,
        force_constant=2e-3,
        top=0.4,
        sample_s=1e-4,
        samples=1500,
        count=9,
    )
    spring = h.one_softer_side(draw.near(0.25) * b.base.stiffness / b.travel)
    return b.machine(
        "tilting mirror with bent flexures", [spring], output_unit=("angle_rad", 1.0)
    )


@machine("springs")
def lift_weight(draw):
    b = draw.bench(
        "steps sine levels",
        mass=7.0,
        pace=3.0,
        damping=0.15,
        force_constant=30.0,
        top=5.0,
        sample_s=2e-3,
        samples=1000,
        count=8,
    )
    return b.machine(
        "vertical axis whose weight was forgotten", [h.weight(-0.3 * b.force)]
    )


@machine("springs")
def pump_vibration(draw):
    b = draw.bench(
        "steps sine multisine",
        mass=12.0,
        pace=4.0,
        damping=0.08,
        force_constant=18.0,
        top=6.0,
        sample_s=2e-3,
        samples=1500,
        count=8,
    )
    floor = h.shaker(0.06 * b.force, draw.near(9.0), draw.angles(b.count))
    # A swing of the output with a phase of its own may be of the sensor as well.
    answers = Answers(full=[["periodic_force"]], near=[["sensor_hum"]])
    return b.machine("table beside a pump", [floor], answers=answers, warm_up=1500)


# Motor and amplifier


@machine("motor")
def voltage_winding(draw):
    b = draw.bench(
        "steps sine levels chirp",
        mass=0.5,
        pace=8.0,
        damping=0.1,
        force_constant=7.0,
        top=12.0,
        sample_s=1e-3,
        samples=1500,
        count=9,
        resistance=4.0,
    )
    return b.machine(
        "coil on a voltage source",
        [h.winding(draw.near(4.0 * 0.012))],
        answers=Answers(
            full=[["winding_inductance"]], near=[["actuator_lag"], ["input_delay"]]
        ),
        input_unit=("voltage_V", 1.0),
    )


@machine("motor")
def folded_winding(draw):
    b = draw.bench(
        "doublets levels steps",
        mass=4e-4,
        pace=3.0,
        damping=0.1,
        force_constant=0.03,
        top=10.0,
        sample_s=1e-3,
        samples=1500,
        count=9,
        free=True,
        resistance=2.0,
    )
    answers = Answers(
        full=[["winding_inductance"]], near=[["actuator_lag"], ["input_delay"]]
    )
    return b.machine(
        "motor on a voltage source, taken for a force with a damper",
        [h.winding(draw.near(2.0 * 0.02))],
        answers=answers,
        noise=0.001,
        input_unit=("voltage_V", 1.0),
        output_unit=("angle_rad", 1.0),
        folded=True,
    )


@machine("motor")
def ripple_motor(draw):
    b = draw.bench(
        "doublets levels steps",
        mass=1.5e-3,
        pace=2.0,
        damping=0.2,
        force_constant=0.12,
        top=2.0,
        sample_s=2e-3,
        samples=1500,
        count=10,
        free=True,
    )
    turns = max(1.0, np.round(12.0 / b.travel * 2.0 * np.pi))
    return b.machine(
        "motor whose torque swings along the turn",
        [h.ripple(draw.near(0.12), float(turns), draw.angle())],
        noise=0.001,
        output_unit=("angle_rad", 1.0),
    )


@machine("motor")
def six_step_motor(draw):
    b = draw.bench(
        "doublets levels steps",
        mass=6e-4,
        pace=2.5,
        damping=0.3,
        force_constant=0.05,
        top=3.0,
        sample_s=2e-3,
        samples=1500,
        count=10,
        free=True,
    )
    pairs = max(1.0, np.round(20.0 / b.travel))
    return b.machine(
        "motor that switches by Hall sensors",
        [h.six_step(float(pairs), draw.angle())],
        answers=Answers(near=[["torque_ripple"], ["torque_ripple", "torque_ripple"]]),
        noise=0.0007,
        output_unit=("angle_rad", 1.0),
    )


@machine("motor")
def linear_motor_two_harmonics(draw):
    b = draw.servo(
        "moves triangles sine",
        mass=9.0,
        damping_time_s=0.5,
        force_constant=35.0,
        travel=0.12,
        bandwidth=5.0,
        sample_s=2e-3,
        samples=1500,
    )
    pitch = draw.near(0.032)
    waves = [
        (0.15 * b.force, pitch, draw.angle()),
        (0.07 * b.force, pitch / 2, draw.angle()),
    ]
    answers = Answers(full=[["cogging", "cogging"]], partial=[["cogging"]])
    return b.machine(
        "iron-core linear motor", [h.teeth(waves)], answers=answers, noise=0.0004
    )


@machine("motor")
def spindle_cogging(draw):
    b = draw.bench(
        "triangles sine steps staircase",
        mass=2e-3,
        pace=3.0,
        damping=0.15,
        force_constant=0.1,
        top=4.0,
        sample_s=2e-3,
        samples=1800,
        count=9,
    )
    wave = (0.08 * b.force, draw.near(0.22 * b.travel), draw.angle())
    return b.machine(
        "small motor against a coil spring",
        [h.teeth([wave])],
        output_unit=("angle_rad", 1.0),
    )


@machine("motor")
def saturating_actuator(draw):
    b = draw.bench(
        "steps sine levels staircase",
        mass=1.0,
        pace=10.0,
        damping=0.12,
        force_constant=14.0,
        top=6.0,
        sample_s=1e-3,
        samples=1000,
        count=10,
    )
    kin = ["force_constant_saturation", "supply_sag", "input_saturation"]
    answers = Answers(near=[*([one] for one in kin), kin[:2]])
    return b.machine(
        "actuator with too little iron",
        [h.saturating_force(draw.near(1.1) * b.top)],
        answers=answers,
        simulation={"reference_current_A": b.top},
    )


@machine("motor")
def press_thermal(draw):
    b = draw.bench(
        "steps levels one_way triangles",
        mass=120.0,
        pace=1.2,
        damping=0.25,
        force_constant=80.0,
        top=25.0,
        sample_s=1e-2,
        samples=2500,
        count=8,
    )
    loss = h.warming(draw.near(0.2), b.top, draw.near(6.0))
    return b.machine(
        "press that warms up", [loss], simulation={"reference_current_A": b.top}
    )


@machine("motor")
def amplifier_limit(draw):
    b = draw.bench(
        "steps sine chirp staircase",
        mass=0.02,
        pace=25.0,
        damping=0.1,
        force_constant=2.0,
        top=3.0,
        sample_s=4e-4,
        samples=1200,
        count=10,
    )
    return b.machine(
        "amplifier at its limit", [h.current_limit(draw.near(0.6, 0.1) * b.top)]
    )


@machine("motor")
def amplifier_slew(draw):
    b = draw.bench(
        "steps sine levels chirp",
        mass=0.7,
        pace=6.0,
        damping=0.12,
        force_constant=9.0,
        top=5.0,
        sample_s=1e-3,
        samples=1500,
        count=10,
    )
    rate = draw.near(1.6 * b.top * 2.0 * np.pi * 6.0 / 6.0)
    return b.machine("slow amplifier", [h.slew(rate)])


@machine("motor")
def valve_soft_dead_zone(draw):
    b = draw.bench(
        "triangles sine staircase steps",
        mass=4.0,
        pace=2.0,
        damping=0.3,
        force_constant=20.0,
        top=2.0,
        sample_s=4e-3,
        samples=1200,
        count=10,
    )
    answers = Answers(near=[["input_dead_zone"]])
    zone = h.dead_zone(draw.near(0.1) * b.top, soft=True)
    return b.machine("servo valve with overlap", [zone], answers=answers)


@machine("motor")
def bus_delay(draw):
    b = draw.bench(
        "steps sine chirp multisine",
        mass=2.5,
        pace=5.0,
        damping=0.1,
        force_constant=16.0,
        top=4.0,
        sample_s=2e-3,
        samples=1200,
        count=8,
    )
    return b.machine("amplifier on a slow bus", [h.delay(draw.near(2.6) * b.sample_s)])


@machine("motor")
def amplifier_lag(draw):
    b = draw.bench(
        "steps chirp multisine",
        mass=0.3,
        pace=12.0,
        damping=0.15,
        force_constant=6.0,
        top=2.0,
        sample_s=5e-4,
        samples=1500,
        count=8,
    )
    return b.machine("lazy amplifier", [h.lag(draw.near(3e-3))])


@machine("motor")
def amplifier_two_lags(draw):
    b = draw.bench(
        "steps chirp multisine sine",
        mass=15.0,
        pace=3.0,
        damping=0.12,
        force_constant=30.0,
        top=7.0,
        sample_s=2e-3,
        samples=1500,
        count=9,
    )
    answers = Answers(
        full=[["actuator_lag", "actuator_lag"]],
        near=[["actuator_lag"], ["input_delay"], ["actuator_lag", "input_delay"]],
    )
    amplifier = h.two_lags(draw.near(0.014), draw.near(0.008))
    return b.machine("amplifier with filter", [amplifier], answers=answers)


@machine("motor")
def battery_sag(draw):
    b = draw.bench(
        "steps sine staircase levels",
        mass=0.25,
        pace=4.0,
        damping=0.2,
        force_constant=1.5,
        top=8.0,
        sample_s=2e-3,
        samples=1000,
        count=10,
    )
    return b.machine(
        "drive on a weak battery",
        [h.sag(draw.near(0.25), b.top)],
        simulation={"reference_current_A": b.top},
    )


@machine("motor")
def bridge_dead_time(draw):
    b = draw.bench(
        "triangles sine steps staircase",
        mass=0.05,
        pace=7.0,
        damping=0.1,
        force_constant=1.2,
        top=6.0,
        sample_s=1e-3,
        samples=1500,
        count=10,
        resistance=3.0,
    )
    drop = h.dead_time(
        draw.near(0.08) * b.top, b.base.resistance, b.base.force_constant
    )
    answers = Answers(near=[["input_dead_zone"]])
    return b.machine(
        "half bridge with dead time",
        [drop],
        answers=answers,
        input_unit=("voltage_V", 1.0),
    )


@machine("motor")
def supply_at_speed(draw):
    b = draw.bench(
        "doublets levels steps",
        mass=0.4,
        pace=1.5,
        damping=0.1,
        force_constant=2.0,
        top=6.0,
        sample_s=4e-3,
        samples=1200,
        count=10,
        free=True,
    )
    limit = draw.near(1.0, 0.1) * b.top
    return b.machine(
        "axis that runs out of voltage",
        [h.speed_limit(limit, draw.near(1.6) * limit / b.speed)],
        noise=0.001,
    )


@machine("motor")
def gains_differ(draw):
    b = draw.bench(
        "steps sine levels",
        mass=1.1,
        pace=5.0,
        damping=0.15,
        force_constant=8.0,
        top=3.0,
        sample_s=2e-3,
        samples=800,
        count=14,
    )
    factors = 1.0 + 0.12 * draw.rng.normal(size=b.count)
    return b.machine(
        "magnets colder or warmer from day to day",
        [h.changed("force_constant", factors)],
    )


# Couplings


@machine("couplings")
def shaft_motor_sensor(draw):
    b = draw.bench(
        "chirp multisine steps",
        mass=0.02,
        pace=4.0,
        damping=0.1,
        force_constant=0.5,
        top=3.0,
        sample_s=1e-3,
        samples=2000,
        count=8,
    )
    shaft = h.shaft(
        b.base, draw.near(5.0) * b.base.stiffness, draw.near(0.5), 0.03, "motor"
    )
    answers = Answers(full=[["elastic_coupling"], ["second_mode"]])
    return b.machine(
        "shaft with a wheel at its end, encoder at the motor",
        [shaft],
        answers=answers,
        output_unit=("angle_rad", 1.0),
    )


@machine("couplings")
def shaft_load_sensor(draw):
    b = draw.bench(
        "chirp multisine steps levels",
        mass=30.0,
        pace=2.0,
        damping=0.1,
        force_constant=25.0,
        top=10.0,
        sample_s=4e-3,
        samples=1500,
        count=8,
    )
    shaft = h.shaft(
        b.base, draw.near(10.0) * b.base.stiffness, draw.near(0.35), 0.04, "load"
    )
    return b.machine("table behind a soft coupling, scale at the table", [shaft])


@machine("couplings")
def gearbox_backlash(draw):
    b = draw.bench(
        "triangles sine steps levels",
        mass=0.8,
        pace=3.0,
        damping=0.15,
        force_constant=7.0,
        top=5.0,
        sample_s=2e-3,
        samples=1200,
        count=9,
    )
    gear = h.gear(
        b.base,
        draw.near(0.03) * b.travel,
        150.0 * b.base.stiffness,
        draw.near(0.4),
        "load",
    )
    return b.machine(
        "gearbox with play, sensor at the load",
        [gear],
        cells=16,
        output_unit=("angle_rad", 1.0),
    )


@machine("couplings")
def gearbox_motor_sensor(draw):
    b = draw.bench(
        "triangles sine steps levels",
        mass=0.5,
        pace=4.0,
        damping=0.25,
        force_constant=5.0,
        top=4.0,
        sample_s=2e-3,
        samples=1200,
        count=9,
    )
    gear = h.gear(
        b.base,
        draw.near(0.04) * b.travel,
        150.0 * b.base.stiffness,
        draw.near(0.3),
        "motor",
    )
    answers = Answers(near=[["gear_backlash"]], honest_refusal=True)
    return b.machine(
        "gearbox with play, encoder at the motor",
        [gear],
        answers=answers,
        cells=48,
        output_unit=("angle_rad", 1.0),
    )


@machine("couplings")
def mirror_second_mode(draw):
    b = draw.bench(
        "chirp multisine steps",
        mass=2e-3,
        pace=20.0,
        damping=0.08,
        force_constant=0.6,
        top=0.5,
        sample_s=2e-4,
        samples=2500,
        count=7,
    )
    part = h.appendage(draw.near(0.25) * b.base.mass, draw.near(45.0), draw.near(0.03))
    answers = Answers(full=[["second_mode"], ["elastic_coupling"]])
    return b.machine(
        "coil with a loose wire bundle", [part], answers=answers, noise=0.002
    )


@machine("couplings")
def two_appendages(draw):
    b = draw.bench(
        "chirp multisine levels",
        mass=80.0,
        pace=1.5,
        damping=0.1,
        force_constant=60.0,
        top=15.0,
        sample_s=4e-3,
        samples=2500,
        count=7,
    )
    parts = [
        h.appendage(0.2 * b.base.mass, draw.near(4.0, 0.1), 0.03),
        h.appendage(0.1 * b.base.mass, draw.near(9.0, 0.1), 0.03),
    ]
    answers = Answers(
        full=[["second_mode", "second_mode"], ["elastic_coupling", "second_mode"]],
        partial=[["second_mode"], ["elastic_coupling"]],
    )
    return b.machine("machine bed with two cabinets", parts, answers=answers)


@machine("couplings")
def pointer_play(draw):
    b = draw.bench(
        "triangles sine steps multisine",
        mass=0.15,
        pace=5.0,
        damping=0.2,
        force_constant=2.0,
        top=2.0,
        sample_s=2e-3,
        samples=1200,
        count=9,
    )
    return b.machine("sensor on a loose lever", [h.play(draw.near(0.03) * b.travel)])


# Sensors


@machine("sensors")
def eccentric_disc(draw):
    b = draw.servo(
        "moves triangles sine",
        mass=0.05,
        damping_time_s=0.6,
        force_constant=0.4,
        travel=9.0,
        bandwidth=2.0,
        sample_s=4e-3,
    )
    disc = h.eccentric(draw.near(0.06), 2.0 * np.pi, draw.angle())
    return b.machine(
        "turntable with a badly centred encoder",
        [disc],
        noise=0.0003,
        output_unit=("angle_rad", 1.0),
    )


@machine("sensors")
def eccentric_pulley(draw):
    b = draw.bench(
        "triangles sine steps staircase",
        mass=1.3,
        pace=4.0,
        damping=0.2,
        force_constant=10.0,
        top=5.0,
        sample_s=2e-3,
        samples=1200,
        count=9,
    )
    disc = h.eccentric(
        draw.near(0.02) * b.travel, draw.near(0.3) * b.travel, draw.angle()
    )
    return b.machine("wire sensor over an eccentric pulley", [disc])


@machine("sensors")
def clipped_range(draw):
    b = draw.bench(
        "steps sine triangles levels",
        mass=0.01,
        pace=30.0,
        damping=0.1,
        force_constant=1.0,
        top=1.0,
        sample_s=3e-4,
        samples=1200,
        count=9,
    )
    return b.machine(
        "laser sensor whose range ends", [h.clipped(draw.near(0.75, 0.1) * b.usual)]
    )


@machine("sensors")
def mains_hum(draw):
    b = draw.bench(
        "steps sine levels",
        mass=6.0,
        pace=3.0,
        damping=0.12,
        force_constant=12.0,
        top=6.0,
        sample_s=2e-3,
        samples=1500,
        count=8,
    )
    noise = h.hum(draw.near(0.03) * b.travel, 50.0, draw.angles(b.count))
    answers = Answers(full=[["sensor_hum"]], near=[["periodic_force"]])
    return b.machine(
        "sensor cable beside a mains cable", [noise], answers=answers, noise=0.005
    )


@machine("sensors")
def bent_potentiometer(draw):
    b = draw.bench(
        "steps sine triangles chirp",
        mass=0.4,
        pace=4.0,
        damping=0.1,
        force_constant=3.0,
        top=3.0,
        sample_s=2e-3,
        samples=1200,
        count=9,
    )
    return b.machine(
        "worn potentiometer",
        [h.bent(draw.near(0.08), b.travel)],
        simulation={"reference_displacement_m": b.travel},
    )


@machine("sensors")
def rolled_off_coil(draw):
    b = draw.bench(
        "steps sine chirp multisine",
        mass=0.06,
        pace=18.0,
        damping=0.1,
        force_constant=2.5,
        top=1.5,
        sample_s=5e-4,
        samples=1200,
        count=9,
    )
    return b.machine(
        "differential transformer at the end of its range",
        [h.rolled_off(-draw.near(0.1), b.travel)],
        simulation={"reference_displacement_m": b.travel},
    )


@machine("sensors")
def drifting_gauge(draw):
    b = draw.bench(
        "steps sine levels",
        mass=20.0,
        pace=2.0,
        damping=0.15,
        force_constant=25.0,
        top=8.0,
        sample_s=5e-3,
        samples=2000,
        count=8,
    )
    return b.machine(
        "strain gauge that warms", [h.drift(draw.near(0.05) * b.travel / b.duration)]
    )


@machine("sensors")
def slow_filter(draw):
    b = draw.bench(
        "steps chirp multisine sine",
        mass=0.9,
        pace=6.0,
        damping=0.12,
        force_constant=8.0,
        top=3.0,
        sample_s=1e-3,
        samples=1500,
        count=8,
    )
    answers = Answers(full=[["actuator_lag"]], near=[["input_delay"]])
    return b.machine(
        "sensor behind a filter", [h.slow_sensor(draw.near(6e-3))], answers=answers
    )


@machine("sensors")
def two_loggers(draw):
    b = draw.bench(
        "sine chirp multisine levels",
        mass=1.8,
        pace=4.0,
        damping=0.1,
        force_constant=11.0,
        top=4.0,
        sample_s=2e-3,
        samples=3500,
        count=6,
    )
    answers = Answers(
        full=[["clock_skew"]], partial=[["input_delay"]], honest_refusal=False
    )
    return b.machine(
        "input and output on two loggers",
        [h.wrong_clock(draw.near(0.004))],
        answers=answers,
    )


# Two effects


@machine("two")
def slide_friction_and_stops(draw):
    b = draw.bench(
        "steps sine triangles chirp",
        mass=3.5,
        pace=3.0,
        damping=0.1,
        force_constant=15.0,
        top=6.0,
        sample_s=3e-3,
        samples=1200,
        count=10,
    )
    both = [
        h.coulomb(draw.near(0.05) * b.force),
        h.stops(draw.near(0.7, 0.1) * b.usual, 10.0 * b.base.stiffness),
    ]
    return b.machine("slide with seals and buffers", both)


@machine("two")
def friction_and_lag(draw):
    b = draw.bench(
        "steps sine triangles multisine",
        mass=0.2,
        pace=9.0,
        damping=0.12,
        force_constant=3.0,
        top=2.5,
        sample_s=1e-3,
        samples=1200,
        count=10,
    )
    both = [h.coulomb(draw.near(0.05) * b.force), h.lag(draw.near(5e-3))]
    return b.machine("rubbing stage on a lazy amplifier", both)


@machine("two")
def belt_carriage(draw):
    b = draw.bench(
        "doublets levels chirp",
        mass=10.0,
        pace=1.5,
        damping=0.2,
        force_constant=12.0,
        top=8.0,
        sample_s=3e-3,
        samples=1500,
        count=9,
        free=True,
    )
    stiffness = b.base.mass * (2.0 * np.pi * draw.near(7.0)) ** 2 * 0.2
    both = [
        h.shaft(b.base, stiffness, draw.near(0.25), 0.05, "load"),
        h.coulomb(draw.near(0.06) * b.force, on_load=True),
    ]
    return b.machine("carriage on a belt", both, noise=0.001)


@machine("two")
def play_and_hardening(draw):
    b = draw.bench(
        "triangles sine steps chirp",
        mass=0.6,
        pace=5.0,
        damping=0.15,
        force_constant=6.0,
        top=4.0,
        sample_s=2e-3,
        samples=1200,
        count=10,
    )
    both = [
        h.play(draw.near(0.025) * b.travel),
        h.cubic(draw.near(0.5) * b.base.stiffness / b.travel**2),
    ]
    return b.machine("hardening spring, loose sensor", both)


@machine("two")
def arm_with_friction(draw):
    b = draw.bench(
        "doublets levels steps",
        mass=0.08,
        pace=1.0,
        damping=0.1,
        force_constant=0.5,
        top=2.0,
        sample_s=4e-3,
        samples=1500,
        count=9,
        free=True,
    )
    both = [
        h.unbalance(draw.near(0.7) * b.force, 0.0),
        h.coulomb(draw.near(0.06) * b.force),
    ]
    return b.machine(
        "hanging arm in a dry bearing", both, output_unit=("angle_rad", 1.0)
    )


@machine("two")
def linear_motor_servo(draw):
    b = draw.servo(
        "moves triangles sine",
        mass=4.0,
        damping_time_s=0.6,
        force_constant=22.0,
        travel=0.1,
        bandwidth=6.0,
        sample_s=1e-3,
        samples=2500,
    )
    both = [
        h.teeth([(0.15 * b.force, draw.near(0.024), draw.angle())]),
        h.coulomb(draw.near(0.12) * b.force),
    ]
    return b.machine("linear motor under position control", both, noise=0.0004)


@machine("two")
def limit_and_delay(draw):
    b = draw.bench(
        "steps sine chirp levels",
        mass=0.03,
        pace=14.0,
        damping=0.12,
        force_constant=1.0,
        top=2.0,
        sample_s=1e-3,
        samples=1000,
        count=10,
    )
    both = [
        h.current_limit(draw.near(0.65, 0.1) * b.top),
        h.delay(draw.near(2.5) * b.sample_s),
    ]
    return b.machine("amplifier that is late and small", both)


@machine("two")
def bent_and_rubbing(draw):
    b = draw.bench(
        "steps sine triangles multisine",
        mass=9.0,
        pace=2.5,
        damping=0.12,
        force_constant=20.0,
        top=6.0,
        sample_s=3e-3,
        samples=1200,
        count=10,
    )
    both = [h.bent(draw.near(0.08), b.travel), h.coulomb(draw.near(0.05) * b.force)]
    return b.machine(
        "rubbing slide with a worn sensor",
        both,
        simulation={"reference_displacement_m": b.travel},
    )


@machine("two")
def warm_and_rubbing(draw):
    b = draw.bench(
        "steps levels triangles sine",
        mass=35.0,
        pace=1.5,
        damping=0.2,
        force_constant=40.0,
        top=12.0,
        sample_s=8e-3,
        samples=2000,
        count=9,
    )
    both = [
        h.warming(draw.near(0.2), b.top, draw.near(4.0)),
        h.coulomb(draw.near(0.05) * b.force),
    ]
    return b.machine(
        "rubbing press that warms up", both, simulation={"reference_current_A": b.top}
    )


@machine("two")
def winding_and_friction(draw):
    b = draw.bench(
        "steps triangles sine chirp",
        mass=0.3,
        pace=5.0,
        damping=0.1,
        force_constant=4.0,
        top=10.0,
        sample_s=1e-3,
        samples=1500,
        count=10,
        resistance=3.0,
    )
    both = [h.winding(draw.near(3.0 * 0.015)), h.coulomb(draw.near(0.06) * b.force)]
    answers = Answers(
        full=[["winding_inductance", "coulomb_friction"]],
        near=[["actuator_lag", "coulomb_friction"]],
        partial=[["winding_inductance"], ["coulomb_friction"], ["actuator_lag"]],
    )
    return b.machine(
        "rubbing coil on a voltage source",
        both,
        answers=answers,
        input_unit=("voltage_V", 1.0),
    )


# Three effects


@machine("three")
def spindle_three(draw):
    b = draw.bench(
        "triangles sine steps chirp",
        mass=5e-3,
        pace=3.0,
        damping=0.12,
        force_constant=0.2,
        top=4.0,
        sample_s=2e-3,
        samples=1800,
        count=12,
    )
    three = [
        h.coulomb(draw.near(0.05) * b.force),
        h.teeth([(0.07 * b.force, draw.near(0.2 * b.travel), draw.angle())]),
        h.delay(draw.near(5.0) * b.sample_s),
    ]
    return b.machine(
        "rubbing motor with teeth on a slow bus", three, output_unit=("angle_rad", 1.0)
    )


@machine("three")
def gauge_three(draw):
    b = draw.bench(
        "triangles sine steps levels",
        mass=1.2,
        pace=5.0,
        damping=0.1,
        force_constant=10.0,
        top=4.0,
        sample_s=2e-3,
        samples=1500,
        count=12,
    )
    three = [
        h.cubic(draw.near(0.5) * b.base.stiffness / b.travel**2),
        h.coulomb(draw.near(0.04) * b.force),
        h.drift(draw.near(0.08) * b.travel / b.duration),
    ]
    return b.machine("hardening, rubbing, with a drifting gauge", three)


@machine("three")
def buffers_three(draw):
    b = draw.bench(
        "steps sine triangles chirp",
        mass=18.0,
        pace=2.0,
        damping=0.12,
        force_constant=30.0,
        top=10.0,
        sample_s=4e-3,
        samples=1500,
        count=12,
    )
    three = [
        h.stops(draw.near(0.7, 0.1) * b.usual, 8.0 * b.base.stiffness),
        h.current_limit(draw.near(0.75, 0.1) * b.top),
        h.coulomb(draw.near(0.04) * b.force),
    ]
    return b.machine("slide with buffers, seals and a small amplifier", three)


@machine("three")
def coupling_three(draw):
    b = draw.bench(
        "chirp multisine steps triangles",
        mass=0.01,
        pace=3.0,
        damping=0.1,
        force_constant=0.3,
        top=3.0,
        sample_s=2e-3,
        samples=1800,
        count=12,
    )
    three = [
        h.appendage(draw.near(0.3) * b.base.mass, draw.near(11.0), 0.03),
        h.coulomb(draw.near(0.05) * b.force),
        h.bent(draw.near(0.06), b.travel),
    ]
    pairs = own_names(three)
    swapped = [
        ["elastic_coupling" if one == "second_mode" else one for one in pairs.full[0]]
    ]
    answers = Answers(
        full=[*pairs.full, *swapped], partial=[*pairs.partial, ["elastic_coupling"]]
    )
    return b.machine(
        "wheel on a shaft, dry bearing, worn sensor",
        three,
        answers=answers,
        simulation={"reference_displacement_m": b.travel},
        output_unit=("angle_rad", 1.0),
    )


# Small effects


@machine("small")
def faint_friction(draw):
    b = draw.bench(
        "steps sine triangles",
        mass=0.9,
        pace=5.0,
        damping=0.12,
        force_constant=7.0,
        top=3.0,
        sample_s=2e-3,
        samples=1200,
        count=8,
    )
    return b.machine(
        "stage that hardly rubs", [h.coulomb(draw.near(0.002) * b.force)], noise=0.008
    )


@machine("small")
def faint_hardening(draw):
    b = draw.bench(
        "steps sine levels",
        mass=20.0,
        pace=2.0,
        damping=0.1,
        force_constant=25.0,
        top=8.0,
        sample_s=4e-3,
        samples=1000,
        count=8,
    )
    spring = h.cubic(draw.near(0.012) * b.base.stiffness / b.travel**2)
    return b.machine("spring that hardly hardens", [spring], noise=0.008)


@machine("small")
def faint_delay(draw):
    b = draw.bench(
        "steps multisine sine",
        mass=0.05,
        pace=10.0,
        damping=0.15,
        force_constant=1.0,
        top=2.0,
        sample_s=1e-3,
        samples=1200,
        count=8,
    )
    return b.machine(
        "amplifier that is hardly late", [h.delay(draw.near(0.2e-3))], noise=0.015
    )


# What no catalogue holds

REFUSE = Answers(honest_refusal=True)


@machine("outside")
def rubber_creep(draw):
    b = draw.bench(
        "steps staircase triangles levels",
        mass=2.0,
        pace=3.0,
        damping=0.15,
        force_constant=12.0,
        top=5.0,
        sample_s=5e-3,
        samples=2000,
        count=8,
    )
    times = b.duration * np.geomspace(0.02, 1.0, 5)
    return b.machine(
        "rubber mount that creeps",
        [h.creep(0.06 * b.base.stiffness, times)],
        answers=REFUSE,
    )


@machine("outside")
def hose_in_the_way(draw):
    b = draw.bench(
        "steps sine levels",
        mass=5.0,
        pace=2.5,
        damping=0.12,
        force_constant=18.0,
        top=5.0,
        sample_s=4e-3,
        samples=1200,
        count=9,
    )
    walk = np.cumsum(draw.rng.normal(size=(200, b.count)), axis=0)
    walk *= 0.08 * b.force / walk[-1].std()
    walk[0] = 0.0
    force = h.wandering_force(walk, b.duration / 190.0)
    return b.machine("stage that drags a hose", [force], answers=REFUSE)


@machine("outside")
def breathing_bellows(draw):
    b = draw.bench(
        "steps sine triangles",
        mass=0.5,
        pace=6.0,
        damping=0.12,
        force_constant=5.0,
        top=3.0,
        sample_s=2e-3,
        samples=1500,
        count=9,
    )
    phases = draw.angles(b.count)
    rate = draw.near(2.5) * 2.0 * np.pi / b.duration
    answers = Answers(partial=[["parameter_change"]], honest_refusal=True)
    spring = h.breathing_spring(b.base.stiffness, 0.25, rate, phases)
    return b.machine("air spring whose pressure swings", [spring], answers=answers)


@machine("outside")
def half_full_tank(draw):
    b = draw.bench(
        "steps chirp levels sine",
        mass=60.0,
        pace=1.5,
        damping=0.1,
        force_constant=70.0,
        top=10.0,
        sample_s=5e-3,
        samples=1600,
        count=8,
    )
    rate = 2.0 * np.pi * 1.5
    damping = 0.25 * b.base.mass * rate**1.5
    both = [
        h.appendage(
            0.4 * b.base.mass, draw.near(2.2), 0.08, hardening=0.5 / b.travel**2
        ),
        h.half_order(0.3 * damping, np.geomspace(0.02, 2.0, 6)),
    ]
    answers = Answers(
        partial=[["second_mode"], ["elastic_coupling"]], honest_refusal=True
    )
    return b.machine("tank in which water sloshes", both, answers=answers)


@machine("outside")
def greased_spindle(draw):
    b = draw.bench(
        "steps sine levels triangles",
        mass=0.03,
        pace=4.0,
        damping=0.05,
        force_constant=0.4,
        top=3.0,
        sample_s=2e-3,
        samples=1500,
        count=9,
    )
    thick = 1.2 * np.sqrt(b.base.stiffness * b.base.mass)
    grease = h.grease(thick, 0.15 * b.duration, 0.5 * b.travel)
    # Stirred more in some recordings than in others.
    answers = Answers(partial=[["parameter_change"]], honest_refusal=True)
    return b.machine(
        "spindle in old grease",
        [grease],
        answers=answers,
        output_unit=("angle_rad", 1.0),
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


@machine("clean")
def clean_noisy_input(draw):
    b = draw.bench(
        "sine steps levels",
        mass=0.7,
        pace=6.0,
        damping=0.12,
        force_constant=5.0,
        top=3.0,
        sample_s=2e-3,
        samples=1200,
        count=9,
    )
    return b.machine("noisy shunt, 3 %", input_noise=0.03)


@machine("clean")
def clean_repeated(draw):
    b = draw.bench(
        "sine steps triangles",
        mass=11.0,
        pace=3.0,
        damping=0.15,
        force_constant=14.0,
        top=6.0,
        sample_s=2e-3,
        samples=1500,
        count=8,
    )
    return b.machine("logger that repeats 3 % of its samples", repeated=0.03)


@machine("clean")
def clean_jitter(draw):
    b = draw.bench(
        "sine levels chirp",
        mass=0.2,
        pace=5.0,
        damping=0.12,
        force_constant=2.0,
        top=2.0,
        sample_s=4e-3,
        samples=1000,
        count=9,
    )
    return b.machine("logger whose clock jitters by 10 %", jitter=0.1, noise=0.005)


@machine("clean")
def clean_hum(draw):
    b = draw.bench(
        "sine steps levels",
        mass=1.5,
        pace=4.0,
        damping=0.12,
        force_constant=7.0,
        top=4.0,
        sample_s=2e-3,
        samples=1500,
        count=8,
    )
    noise = h.hum(0.008 * b.travel, 50.0, draw.angles(b.count))
    return b.machine(
        "a little mains hum in the sensor",
        nuisances=[noise],
        noise=0.01,
        answers=Answers(full=[["sensor_hum"]], near=[["periodic_force"]]),
    )


@machine("clean")
def clean_coarse(draw):
    b = draw.bench(
        "sine steps triangles",
        mass=0.02,
        pace=8.0,
        damping=0.15,
        force_constant=0.4,
        top=2.0,
        sample_s=1e-3,
        samples=1200,
        count=8,
    )
    return b.machine(
        "encoder of few lines",
        nuisances=[h.coarse(0.02 * b.travel)],
        noise=0.001,
        output_unit=("angle_rad", 1.0),
    )


@machine("clean")
def clean_coloured(draw):
    b = draw.bench(
        "sine steps levels",
        mass=4.0,
        pace=3.0,
        damping=0.12,
        force_constant=9.0,
        top=5.0,
        sample_s=3e-3,
        samples=1200,
        count=8,
    )
    return b.machine(
        "sensor whose noise is coloured", noise_correlation=0.9, noise=0.01
    )


@machine("clean")
def clean_zeros(draw):
    b = draw.bench(
        "sine steps levels",
        mass=0.09,
        pace=9.0,
        damping=0.12,
        force_constant=1.5,
        top=2.0,
        sample_s=1e-3,
        samples=1000,
        count=10,
    )
    zeros = 0.01 * b.travel * draw.rng.normal(size=b.count)
    return b.machine(
        "sensor whose zero differs from recording to recording",
        nuisances=[h.offset(zeros)],
        noise=0.005,
        settings={"initial_state": "held"},
    )


@machine("clean")
def clean_servo(draw):
    b = draw.servo(
        "moves sine triangles",
        mass=0.3,
        damping_time_s=0.4,
        force_constant=1.0,
        travel=2.0,
        bandwidth=5.0,
        sample_s=1e-3,
        samples=2000,
    )
    return b.machine(
        "free axis under position control", noise=0.0005, output_unit=("angle_rad", 1.0)
    )


@machine("clean")
def clean_ringing(draw):
    b = draw.bench(
        "steps chirp one_way",
        mass=0.05,
        pace=11.0,
        damping=0.006,
        force_constant=0.5,
        top=1.0,
        sample_s=2e-3,
        samples=2500,
        count=6,
    )
    return b.machine("tuning fork that rings for long", lengths=(0.5, 1.0))


@machine("clean")
def clean_slow(draw):
    b = draw.bench(
        "steps levels staircase",
        mass=150.0,
        pace=0.5,
        damping=1.4,
        force_constant=90.0,
        top=20.0,
        sample_s=1e-2,
        samples=900,
        count=12,
    )
    return b.machine(
        "damper that creeps back", exact=True, lengths=(0.5, 1.0), noise=0.02
    )


@machine("clean")
def clean_known_friction(draw):
    b = draw.bench(
        "triangles sine steps",
        mass=2.4,
        pace=4.0,
        damping=0.1,
        force_constant=14.0,
        top=4.0,
        sample_s=2e-3,
        samples=1200,
        count=9,
    )
    force = draw.near(0.06 * b.force)
    given = {
        "effects": {"coulomb_friction": {"force_N": draw.near(1.15, 0.05) * force}}
    }
    return b.machine(
        "stage whose friction the simulation has, a little wrong",
        known=[h.coulomb(force)],
        simulation=given,
    )


@machine("clean")
def clean_known_winding(draw):
    b = draw.bench(
        "steps chirp levels",
        mass=0.08,
        pace=7.0,
        damping=0.1,
        force_constant=2.0,
        top=8.0,
        sample_s=1e-3,
        samples=1500,
        count=8,
        resistance=2.5,
    )
    inductance = draw.near(2.5 * 0.01)
    return b.machine(
        "coil on a voltage source, inductance known",
        known=[h.winding(inductance)],
        simulation={"inductance_H": inductance},
        input_unit=("voltage_V", 1.0),
    )


# Noise of the logged input on a free axis, which adds it up, beside a fine encoder


@machine("clean")
def clean_free_noisy_log(draw):
    b = draw.bench(
        "doublets levels steps",
        mass=12.0,
        pace=2.0,
        damping=0.2,
        force_constant=40.0,
        top=6.0,
        sample_s=1e-3,
        samples=1500,
        count=6,
        free=True,
    )
    return b.machine("linear motor, noisy log", noise=2e-5, input_noise=0.002)


@machine("clean")
def clean_servo_noisy_log(draw):
    b = draw.servo(
        "moves sine triangles",
        mass=2e-4,
        damping_time_s=0.3,
        force_constant=0.11,
        travel=3.0,
        bandwidth=8.0,
        sample_s=1e-3,
    )
    return b.machine(
        "servo under position control, noisy log",
        noise=2e-5,
        input_noise=0.01,
        output_unit=("angle_rad", 1.0),
    )


@machine("noisy log")
def gantry_coulomb_noisy_log(draw):
    b = _gantry(draw)
    return b.machine(
        "gantry on rails, noisy log",
        [h.coulomb(0.08 * b.force)],
        noise=2e-5,
        input_noise=0.002,
    )


@machine("noisy log")
def ripple_noisy_log(draw):
    b = draw.bench(
        "doublets levels steps",
        mass=1.5e-3,
        pace=2.0,
        damping=0.2,
        force_constant=0.3,
        top=2.0,
        sample_s=1e-3,
        samples=1500,
        count=6,
        free=True,
    )
    turns = max(1.0, np.round(12.0 / b.travel * 2.0 * np.pi))
    return b.machine(
        "motor with torque ripple and friction, noisy log",
        [
            h.ripple(draw.near(0.08), float(turns), draw.angle()),
            h.coulomb(0.06 * b.force),
        ],
        noise=2e-5,
        input_noise=0.002,
        output_unit=("angle_rad", 1.0),
    )


@machine("noisy log")
def wheel_coulomb_noisy_log(draw):
    b = _wheel(draw)
    return b.machine(
        "wheel under position control, noisy log",
        [h.coulomb(0.08 * b.force)],
        noise=2e-5,
        input_noise=0.01,
        output_unit=("angle_rad", 1.0),
    )
