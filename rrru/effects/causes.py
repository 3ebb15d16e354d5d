"""Table of the library's effects: what each means on a machine, what to inspect there and what to do about it.

Texts about drives depend on their kind, see `rrru.robots.drive_words`; "{moved}" is what a turning drive moves. A
user-defined effect has no entry. Sources are standards and textbooks; NO_SOURCE marks a rule of the trade.
"""

from dataclasses import dataclass

from rrru.robots.drive_words import LENGTH, SLIDING, TURNING, DriveWords

NO_SOURCE = "rule of the trade, no source"

_MOORING = "Mooring, Roth and Driels, Fundamentals of Manipulator Calibration, 1991"
_ISO_9283 = "ISO 9283:1998 (performance criteria of manipulating industrial robots)"
_REVERSAL = "ISO 230-2 (reversal value of an axis)"
_THERMAL = "ISO 230-3 (thermal effects)"
_SLOCUM = "Slocum, Precision Machine Design, 1992"
_MERLET = "Merlet, Parallel Robots, 2nd edition, 2006"
_FRADEN = "Fraden, Handbook of Modern Sensors, 2010 (optical encoders)"
_GEARS = "Litvin and Fuentes, Gear Geometry and Applied Theory, 2004 (functions of transmission errors)"
_FRICTION = "Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30, 1994 (friction of machines)"
_ROBOTICS = "Siciliano, Sciavicco, Villani and Oriolo, Robotics: Modelling, Planning and Control, 2009"


@dataclass(frozen=True)
class Cause:
    """Texts of one effect, each one text or one by kind of drive: what it is, what to inspect, what to do, source."""

    meaning: str | dict[str, str]
    inspect: str | dict[str, str]
    remedy: str | dict[str, str]
    source: str


CAUSES = {
    "backlash": Cause(
        {
            TURNING: "backlash between motor and {moved}",
            SLIDING: "backlash between motor and slide, as in a nut, a rack or a belt",
            LENGTH: "backlash between motor and leg, as in a nut, or slack of a cable",
        },
        {
            TURNING: "Block the motor and turn the {moved} by hand to and fro with a dial gauge at its end: gearbox, "
            "coupling, keyway and clamping.",
            SLIDING: "Block the motor and push the slide to and fro against a dial gauge: nut, thrust bearing of the "
            "screw, coupling; rack and pinion; tension of the belt.",
            LENGTH: "Block the motor and pull and push the leg along itself against a dial gauge: nut, thrust bearing, "
            "coupling, ball joints; of a cable its pretension and its drum.",
        },
        {
            TURNING: "Set the gear's mesh or preload, or replace the gearbox. Until then come to every pose from the "
            "same side, or command the backlash found at each reversal.",
            SLIDING: "Renew or preload the nut and the thrust bearing, tighten rack or belt. Until then come to every "
            "pose from the same side, or set the width found as the axis' backlash compensation.",
            LENGTH: "Renew or preload nut and thrust bearing; raise the cables' pretension. Until then come to every "
            "pose from the same side, or command the backlash found at each reversal.",
        },
        _REVERSAL,
    ),
    "drive_compliance": Cause(
        {
            TURNING: "between motor and {moved} the drive deflects under the torque of the loads",
            SLIDING: "between motor and slide the drive deflects under the force of the loads",
            LENGTH: "the leg and its drive deflect along the leg under the force of the loads",
        },
        {
            TURNING: "Hold the motor, load the {moved} with a known weight and read how far it turns: gearbox, "
            "coupling, belt, clamping; gain of the position loop.",
            SLIDING: "Hold the motor, push the slide with a known force and read how far it goes: screw, nut and "
            "thrust bearing, or length and tension of the belt; gain of the position loop.",
            LENGTH: "Hold the motor, load the leg along itself with a known force and read how far it goes: screw, "
            "nut, thrust bearing, ball joints; of a cable its cross-section.",
        },
        "Check payload, centre of mass and tool mass in the controller's payload table; correct the commands for the "
        "load with the compliance found, or stiffen the compliant part.",
        f"{_ISO_9283}, static compliance; Nubiola and Bonev, Robotics and Computer-Integrated Manufacturing 29, 2013 "
        "(joint compliances identified with a laser tracker)",
    ),
    "link_flexure": Cause(
        "links that push a platform deflect along their length, links and bearings of an arm across its joints",
        "Load the platform with a known weight and read where it sinks: clamps and glued ends of the links, bearings "
        "of the joints, cracks, loose screws.",
        "Tighten or stiffen the link or its bearing; check the mass of tool and payload in the payload table; correct "
        "the commands for the load.",
        f"{_ISO_9283}, static compliance; Wernholt and Moberg, Automatica 47, 2011 (springs across joints)",
    ),
    "joint_clearance": Cause(
        "the pin of a passive joint lies on the side of its bore towards which the leg pushes",
        "With the drives held, push the platform to and fro by hand near each passive joint and feel or gauge the "
        "jump: bearings, ball cups, bolts of universal joints.",
        "Renew or preload the joint (springs, ball cups, tapered bearings), or drive so that the leg's force keeps its "
        "sign.",
        f"{_MERLET}; Parenti-Castelli and Venanzi, Mechanism and Machine Theory 40, 2005",
    ),
    "leg_asymmetry": Cause(
        "the legs' link lengths differ",
        "Measure the links between their joints' centres, all on one fixture.",
        "Calibrate each leg's lengths on its own, or set the links to equal length.",
        f"{_MOORING}; {_MERLET}",
    ),
    "axis_tilt": Cause(
        "a drive axis that is neither tangential nor horizontal",
        "Measure the axis of each motor's seat with a level and an angle gauge, or with the instrument on a target "
        "that turns with the drive arm (a circle's normal is the axis).",
        "Shim or realign the motor's seat, or calibrate the axes' directions.",
        f"{_MOORING} (circle point analysis)",
    ),
    "rail_tilt": Cause(
        "a slide's rail does not point where the drawing says",
        "Measure straightness and direction of each rail: level, autocollimator, or a target on the carriage driven "
        "along the rail.",
        "Shim the rail, or calibrate the rails' directions.",
        "ISO 230-1 (straightness and squareness of axes)",
    ),
    "base_placement": Cause(
        "a leg stands elsewhere on the base than the drawing says",
        "Measure the seats of the legs on the base with the instrument; look for loose bolts and dirt under the seats.",
        "Set the seat where it belongs, or calibrate with the places found.",
        f"{_MOORING}; {_MERLET}",
    ),
    "frame_misregistration": Cause(
        "the instrument's frame is not the robot's",
        "Measure the marks of the base again: were all seen, are they tight, has the instrument or the base been "
        "moved?",
        "Register anew, with marks far apart, or state `frame: register`. Correct nothing on the robot for it.",
        f"{_MOORING}; Arun, Huang and Blostein, IEEE Transactions on Pattern Analysis and Machine Intelligence 9, 1987",
    ),
    "encoder_eccentricity": Cause(
        "the encoder's disc sits off its shaft's centre and errs once per turn of the {moved}",
        "Gauge the run-out of the encoder's disc and of its shaft; compare the encoder with a second reading head "
        "opposite, or with a reference encoder over a turn.",
        "Centre the disc, use two opposite heads, or put the amplitude and phase found into the encoder's correction "
        "table.",
        _FRADEN,
    ),
    "encoder_ovality": Cause(
        "the encoder's ring is out of round, or its disc tilted, and it errs twice per turn of the {moved}",
        "Gauge roundness of the ring and axial run-out of the disc where it sits; look at its screws and its seat.",
        "Seat the ring anew on a round, clean shaft, or put the amplitude and phase found into the encoder's "
        "correction table.",
        "Lu, Graetz, Amin-Shahidi and Smeds, CIRP Annals 59, 2010 (harmonics of angle encoders)",
    ),
    "transmission_error": Cause(
        {
            TURNING: "the gear leads and lags in waves, as many per turn of the {moved} as the ratio says",
            SLIDING: "the screw, or the pulley of the belt, leads and lags once per turn",
            LENGTH: "the screw of the leg, or the drum of the cable, leads and lags once per turn",
        },
        {
            TURNING: "Gauge the run-out of motor shaft, wave generator and gears; look for worn or broken teeth; "
            "compare the order found with the gear ratio.",
            SLIDING: "Gauge the run-out of screw, coupling and pulley; compare the lead found with the data sheet's.",
            LENGTH: "Gauge the run-out of screw, coupling or drum; compare the lead or circumference found with the "
            "data sheet's.",
        },
        {
            TURNING: "Realign or replace the gear stage that turns at the order found, or put the wave found into the "
            "axis' correction table.",
            SLIDING: "Realign coupling and bearing, or put the wave found into the axis' error compensation.",
            LENGTH: "Realign coupling and bearing, or put the wave found into the leg's error compensation.",
        },
        f"{_GEARS}; of screws ISO 3408-3 (travel deviation of ball screws)",
    ),
    "transmission_orders": Cause(
        "drives lead and lag in several sharp waves per turn, each of its own orders",
        "Compare the orders found with those of the gear's stages: motor shaft, wave generator, planets, tooth mesh, "
        "belt; gauge run-out there.",
        "Realign or replace the stage that turns at the order found, or put the waves found into the axis' correction "
        "table.",
        _GEARS,
    ),
    "drive_error_function": Cause(
        {
            TURNING: "the error of the drive is a function of its own angle",
            SLIDING: "the error of the slide is a function of its own position",
            LENGTH: "the error of the leg is a function of its own length",
        },
        {
            TURNING: "Inspect the drive at the angle of the largest error: encoder's scale for dirt, scratches and "
            "run-out, gear's teeth, bearing; cables that pull.",
            SLIDING: "Inspect the slide at the place of the largest error: scale or encoder for dirt and scratches, "
            "screw's pitch, rack's teeth, belt; guides and cables that pull.",
            LENGTH: "Inspect the leg at the length of the largest error: scale or encoder for dirt and scratches, "
            "screw's pitch; cables that pull.",
        },
        "Clean or recentre the scale, repair what is worn there, or put the function found into the "
        "axis' correction table.",
        f"{_FRADEN}; {_GEARS}",
    ),
    "friction_windup": Cause(
        {
            TURNING: "the drive train twists against friction and unwinds after each reversal over some travel",
            SLIDING: "screw, rack or belt strains against friction and relaxes after each reversal over some travel",
            LENGTH: "the leg's drive strains against friction and relaxes after each reversal over some travel",
        },
        {
            TURNING: "Read the motor's current while it turns slowly to and fro: bearings, seals, gear's preload and "
            "lubrication, dragging cables.",
            SLIDING: "Read the motor's current while the slide goes slowly to and fro: guides, wipers, nut's preload, "
            "lubrication, dragging cables.",
            LENGTH: "Read the motor's current while the leg goes slowly in and out: guides, seals, nut's preload, ball "
            "joints, pulleys, lubrication.",
        },
        "Lubricate, free what drags, set too high a preload back. Until then come to every pose from the same side.",
        _FRICTION,
    ),
    "servo_lag": Cause(
        {
            TURNING: "the joint follows its command late",
            SLIDING: "the slide follows its command late",
            LENGTH: "the leg follows its command late",
        },
        "Read the following error at constant speed in the controller; compare gains of the position loops; compare "
        "the clocks of instrument and controller.",
        "Set equal and higher loop gains or a feed-forward of speed; measure at rest where speed does not matter; time "
        "readings by a trigger.",
        f"Franklin, Powell and Emami-Naeini, Feedback Control of Dynamic Systems (velocity error); {_ISO_9283}, path "
        "accuracy",
    ),
    "read_before_rest": Cause(
        "the drives were read before the arm stood still, the point was measured when it did",
        "Look at the position after a move over time: how long until it stays within the noise? Compare the instants "
        "of both readings.",
        "Wait longer at each stop before anything is read, and read drives and instrument at one time.",
        f"{_ISO_9283}, position stabilization time; {_ROBOTICS}",
    ),
    "thermal_growth": Cause(
        "all links grow with time towards a limit while the robot warms up",
        "Measure one pose again and again from a cold start, with the temperatures of links and motors.",
        "Warm the robot up before measuring and before work, as long as the time constant found asks for; measure at "
        "the temperature of use.",
        f"{_ISO_9283}, drift of pose characteristics; {_THERMAL}; Mayr et al., CIRP Annals 61, 2012",
    ),
    "link_growth": Cause(
        "single links grow with time towards a limit, each with a strain of its own, while the robot warms up",
        "Measure one pose again and again from a cold start, with the temperature of each link and of its motor.",
        "Warm the robot up before measuring and before work; keep the heat of the motor from the link, or measure at "
        "the temperature of use.",
        f"{_ISO_9283}, drift of pose characteristics; {_THERMAL}; Mayr et al., CIRP Annals 61, 2012",
    ),
    "zero_drift": Cause(
        "the zeros of the drives move with time towards a limit while motors and gears warm up",
        "Measure one pose again and again from a cold start, with the temperature of each motor and gear. Drive each "
        "joint to its mark or reference switch before and after a run; look for a coupling, belt or encoder seat that "
        "slips.",
        "Warm the robot up before measuring and before work; reference the drives again in between; tighten what "
        "slips.",
        f"{_ISO_9283}, drift of pose characteristics; Heisel et al., CIRP Annals 46, 1997",
    ),
    "thermal_expansion": Cause(
        "all links have the length that belongs to the temperature that was measured",
        "Compare the robot's temperature at several places with the probe's; look for heat from motors, sun or doors.",
        "Keep the temperature, or scale the lengths by the expansion found and the temperature measured.",
        f"ISO 1:2022 (reference temperature); {_THERMAL}",
    ),
    "screw_growth": Cause(
        "the screws, racks or scales that make and measure a slide's way grow while they warm up",
        "Measure the slide's two ends again and again from a cold start; feel nut, bearings and motor for heat; see at "
        "which end the screw is held.",
        "Warm up before measuring and work, lower the preload or cool nut and screw, hold the screw by pretension at "
        "both ends, or measure the slide's way by a scale.",
        f"{_THERMAL}; Mayr et al., CIRP Annals 61, 2012; {_SLOCUM}",
    ),
    "lead_error": Cause(
        "a screw, rack or belt moves its slide by a constant share more or less than commanded",
        "Compare the slide's way over its whole stroke with a scale or a laser interferometer. Look up the lead or the "
        "steps per millimetre in the controller. Look for a belt of another pitch or tension.",
        "Multiply the lead in the controller by 1 + the share found, or divide the steps per millimetre by it.",
        "ISO 230-2; ISO 3408-3 (travel deviation of ball screws)",
    ),
    "gain_error": Cause(
        "a joint turns by a constant share more or less than commanded",
        "Turn the joint through its whole range and compare its angle with an angle gauge, or with the instrument on a "
        "target that turns with it. Look up gear ratio, counts per turn and gain of the sensor in the controller; "
        "measure the diameters of drums and pulleys.",
        "Divide the gear ratio, or the counts per turn of the joint, in the controller by 1 + the share found, or "
        "divide the commands by it.",
        "Hollerbach, Khalil and Gautier, Springer Handbook of Robotics, 2016 (model identification)",
    ),
    "bar_mismatch": Cause(
        "the two bars of one arm differ in length",
        "Measure all bars between their ball centres on one fixture with two pins.",
        "Make or choose bars in pairs of equal length.",
        NO_SOURCE,
    ),
    "tool_offset": Cause(
        "the measured point does not sit on the platform where it should",
        "Measure where reflector or tool tip sits on the flange; look at its nest, its magnet and the tool table of "
        "the controller.",
        "State the place measured (`targets:` or the tool's frame) and measure again.",
        _MOORING,
    ),
    "joint_axis_error": Cause(
        "axes of joints, driven and passive, that do not lie where the drawing says",
        "Measure a target while each joint turns alone: the centre and normal of its circle are the axis.",
        "Calibrate with all numbers of the chain (`errors: full`); replace a joint only where its axis is off by more "
        "than its drawing allows.",
        f"{_MOORING} (circle point analysis)",
    ),
    "cross_compliance": Cause(
        "the torque about one joint of a trunk deflects another one",
        "Load one joint with a known torque and read the others: rods, belts or cables that joints share, housing that "
        "carries two gears.",
        "Stiffen the shared part, or correct the commands for the loads with the compliances found.",
        "Betti, Teoria della elasticita, Il Nuovo Cimento 7, 1872 (reciprocity); inspection: " + NO_SOURCE,
    ),
    "base_drift": Cause(
        "robot and instrument creep against each other while a campaign lasts",
        "Measure marks on the robot's base at the beginning, in between and at the end: stand of the instrument, "
        "floor, bolts of the base.",
        "Let robot and instrument warm up and settle; clamp the stand; register again in between.",
        f"{_ISO_9283}, drift of pose characteristics; {_THERMAL}, environmental temperature variation",
    ),
    "pedestal_compliance": Cause(
        "the robot's pedestal deflects under the moment of its weight",
        "Put a level or a target on the robot's foot and stretch the robot out to all sides: bolts, levelling feet, "
        "table, floor plate.",
        "Tighten or stiffen what the robot stands on, or fix the reference marks to the robot's foot.",
        NO_SOURCE,
    ),
    "tracker_scale": Cause(
        "the instrument's millimetre is not the robot's",
        "Measure a scale bar of known length with the instrument; check its weather station and the temperature of the "
        "scale bar and of the marks.",
        "Set temperature, pressure and humidity, or have the instrument checked; correct nothing on the robot for it.",
        "ISO 10360-10 (acceptance of laser trackers); Ciddor, Applied Optics 35, 1996 (refractive index of air)",
    ),
}


@dataclass(frozen=True)
class CauseTexts:
    """Texts of one effect on one robot, empty for a user-defined effect."""

    meaning: str = ""
    inspect: str = ""
    remedy: str = ""
    source: str = ""


def cause_texts(name: str, words: DriveWords | None = None, numbers: tuple[int, ...] = ()) -> CauseTexts:
    """The CauseTexts of an effect, for the kinds of the drives at which it acts.

    words: DriveWords of the robot, by default of one with turning drives and a leg for each; numbers: drives at which
    the effect acts, from 1 on, all where empty.
    """
    if name not in CAUSES:
        return CauseTexts()
    words, cause = words or DriveWords(), CAUSES[name]
    kinds = words.kinds_of(numbers)

    def chosen(text: str | dict[str, str], between: str) -> str:
        texts = [text] if isinstance(text, str) else dict.fromkeys(text[kind] for kind in kinds)
        return between.join(texts).format(moved=words.moved)

    return CauseTexts(chosen(cause.meaning, "; "), chosen(cause.inspect, " "), chosen(cause.remedy, " "), cause.source)
