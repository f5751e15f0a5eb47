"""Runs of a co-simulation unit."""

import shutil
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import (
    FMU2Slave,
    calloc,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
    free,
)


def simulated(path, signal, step, start=0):
    """Output by FMPy's own simulation, which sets an input before each step."""
    times = step * np.arange(signal.size)
    given = np.array(
        list(zip(times, signal, strict=True)), dtype=[("time", float), ("u", float)]
    )
    found = fmpy.simulate_fmu(
        str(path),
        start_time=0.0,
        stop_time=times[-1],
        output_interval=step,
        step_size=step,
        input=given,
        output=["y"],
        start_values={"initial_state": start} if start else {},
    )
    return found["y"]


def answered(path, signal, step):
    """Output where each input is set before the output of the same instant is read."""
    folder = fmpy.extract(str(path))
    try:
        description = fmpy.read_model_description(folder)
        unit = FMU2Slave(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="one",
        )
        # FMPy's own logger goes by way of the last one of the process, which may be gone.
        callbacks = fmi2CallbackFunctions(
            logger=fmi2CallbackLoggerTYPE(lambda *_: None),
            allocateMemory=fmi2CallbackAllocateMemoryTYPE(calloc),
            freeMemory=fmi2CallbackFreeMemoryTYPE(free),
        )
        unit.instantiate(callbacks=callbacks)
        unit.setupExperiment(startTime=0.0)
        unit.enterInitializationMode()
        unit.exitInitializationMode()
        found = []
        for n, value in enumerate(signal):
            unit.setReal([0], [value])
            found += unit.getReal([1])
            unit.doStep(currentCommunicationPoint=n * step, communicationStepSize=step)
        unit.terminate()
        unit.freeInstance()
        return np.array(found)
    finally:
        shutil.rmtree(Path(folder))
