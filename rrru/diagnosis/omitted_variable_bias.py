"""Omitted-variable bias of a calibration without an effect of how the campaign was measured. Lengths mm, angles rad."""

import numpy as np

from rrru.kinematics.legs import WORLD


def bias_notes(inference):
    """Sentences on the bias that each effect of the corrected model would cause if it were omitted, such as "without
    read_before_rest joint_1_x would be off by 7.1 standard errors: ..".

    The biased parameters are those of the least-squares fit to the omitted effect. Each bias is in units of the
    standard error that a calibration without the effect would state. Parameters of the frame do not count.
    """
    case, linear = inference.case, inference.evidence.linear
    flat = linear.base.reshape(linear.data.size, -1)
    size = np.linalg.norm(flat, axis=0)
    inverse = np.linalg.pinv(flat / size, rcond=1e-9)
    robot = case.mechanism
    frame = np.abs(robot.directions[robot.legs.site_numbers[WORLD]]).any(axis=0)
    acting = {key: linear.columns[key] @ numbers for key, numbers in inference.state.effects.items()}
    unexplained = (linear.data - sum(acting.values(), np.zeros(linear.data.shape))).ravel()
    notes = []
    for (name, _), change in acting.items():
        # a discrepancy function is no effect of the library
        if name in case.effects and case.effects[name].spoils:
            left = unexplained + change.ravel()
            left = left - flat @ (inverse @ left / size)
            noise = np.sqrt((left**2).sum() / max(len(left) - flat.shape[1], 1))
            off = np.where(frame, 0.0, np.abs(inverse @ change.ravel()) / (noise * np.linalg.norm(inverse, axis=1)))
            worst = int(off.argmax())
            wrong = f"{robot.parameters.names[worst]} would be off by {off[worst]:.2g} standard errors"
            notes.append(f"without {name} {wrong}: {case.effects[name].spoils}")
    return tuple(notes)
