"""Printers drawn with a known truth: six rods solved in space by Newton, a probe with an offset, a bent bed."""

import numpy as np
from scipy.spatial.transform import Rotation

from rrru.studies.printers.printer import Printer

ANGLES = np.array([210.0, 330.0, 90.0])
SPACING_MM, JOINTS_MM = 60.0, 30.0


class Drawn:
    """A true machine near a nominal one: numbers off, towers lean, rods unequal, the bed bent."""

    def __init__(self, generator, rods_mm=(0.0, 0.0, 0.0), bed_mm=0.0):
        self.radius = generator.uniform(80.0, 170.0)
        self.arm = self.radius * generator.uniform(2.0, 2.3)
        self.bed_radius, self.endstop = 0.8 * self.radius, self.radius * 2.0
        self.rods = self.arm + generator.normal(0.0, 0.2, 3)[:, None] + 0.5 * np.outer(rods_mm, [1.0, -1.0])
        self.true_radius = self.radius + generator.normal(0.0, 0.3)
        self.true_angle = np.radians(ANGLES + np.append(generator.normal(0.0, 0.1, 2), 0.0))
        self.zero = self.endstop + np.sqrt(self.arm**2 - self.radius**2) + generator.normal(0.0, 0.3, 3)
        self.lean = generator.normal(0.0, 0.002, (3, 2))
        self.bed = generator.normal(0.0, bed_mm, 3) if bed_mm else np.zeros(3)

    def _rod_errors(self, pose, carriages):
        """Squared lengths of the six rods less what they are, (n, 6), at poses (n, 6)."""
        turn = Rotation.from_rotvec(pose[:, 3:]).as_matrix()
        errors = []
        for tower, angle in enumerate(self.true_angle):
            out, across = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([-np.sin(angle), np.cos(angle), 0.0])
            for side, length in zip((0.5, -0.5), self.rods[tower], strict=True):
                joint = side * SPACING_MM * across
                end = pose[:, :3] + turn @ (JOINTS_MM * out + joint)
                errors.append(((carriages[:, tower] + joint - end) ** 2).sum(axis=1) - length**2)
        return np.stack(errors, axis=1)

    def pose(self, drops, start):
        """Pose (n, 6) of the platform with the carriages at drops (n, 3) below the endstops, Newton by differences."""
        carriages = np.zeros((len(drops), 3, 3))
        for tower, angle in enumerate(self.true_angle):
            out, across = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([-np.sin(angle), np.cos(angle), 0.0])
            height = self.zero[tower] - drops[:, tower, None]
            leaning = self.lean[tower, 0] * out + self.lean[tower, 1] * across + [0.0, 0.0, 1.0]
            carriages[:, tower] = (self.true_radius + JOINTS_MM) * out + height * leaning
        pose, step = np.column_stack([start, np.zeros((len(start), 3))]), 1e-6
        for _ in range(6):
            error = self._rod_errors(pose, carriages)
            slope = [(self._rod_errors(pose + step * one, carriages) - error) / step for one in np.eye(6)]
            pose = pose - np.linalg.solve(np.stack(slope, axis=2), error[..., None])[..., 0]
        return pose

    def bed_height(self, x, y):
        """Height of the bed under x and y."""
        shapes = np.array([x**2 + y**2, x**2 - y**2, 2.0 * x * y]) / self.bed_radius**2
        return self.bed @ shapes

    def nominal(self, drops=None, heights=None, probe=None):
        """The printer as its owner's file has it."""
        nothing = np.empty((0, 3))
        drops, heights = nothing if drops is None else drops, np.empty(0) if heights is None else heights
        numbers = self.radius, ANGLES, np.full(3, self.arm), np.full(3, self.endstop), np.full(3, 0.0125)
        none = np.empty(0), np.empty((0, 2, 3))
        return Printer("drawn", "", *numbers, heights, drops, *none, np.empty((0, 2)) if probe is None else probe)

    def probed(self, sets, noise_mm, generator, by_hand=2.0, zero_mm=0.05):
        """The printer with heights of sets: places (n, 2) of the nozzle and the probe's offset (2,).

        noise_mm: of a probed height, by_hand times as much of one touched by by_hand; zero_mm: how well every probe's
        own height is known.
        """
        drops, heights, probes = [], [], []
        robot = self.nominal().mechanism("heights")
        for places, offset in sets:
            start = np.column_stack([places, np.zeros(len(places))])
            drop, touched = -robot.inverse(start), ~np.any(offset)
            for _ in range(3):
                pose = self.pose(drop, start)
                tip = pose[:, :3] + Rotation.from_rotvec(pose[:, 3:]).as_matrix() @ [*offset, 0.0]
                drop = drop + (tip[:, 2] - self.bed_height(tip[:, 0], tip[:, 1]))[:, None]
            drops.append(drop + generator.normal(0.0, noise_mm * (by_hand if touched else 1.0), len(drop))[:, None])
            heights.append(np.full(len(drop), 0.0 if touched else generator.normal(0.0, zero_mm)))
            probes.append(np.tile(offset, (len(drop), 1)))
        # whole microsteps are finer than any noise here
        return self.nominal(*(np.concatenate(one) for one in (drops, heights, probes)))


def rings(radius, count):
    """Places of a centre and rings around it."""
    turns = [(ring, 2.0 * np.pi * k / (6 * ring)) for ring in range(1, count + 1) for k in range(6 * ring)]
    places = [(radius * ring / count * np.cos(turn), radius * ring / count * np.sin(turn)) for ring, turn in turns]
    return np.array([(0.0, 0.0), *places])
