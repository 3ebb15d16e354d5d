CHECKS.append("rrru.diagnosis.settings:check")


# one job per campaign with its figures, because starting another job takes longer than drawing them. It reads the
# measurements and the robot's part of the configuration
rule diagnose:
    input:
        measurements=part("measurements"),
    output:
        **named([*GAP_TABLES, "gap_points"], part),
        **drawn(GAP_FIGURES, "figures/{campaign}"),
        verdict=verdict(),
    log:
        f"{RESULTS}/logs/diagnose/{{campaign}}.log",
    wildcard_constraints:
        campaign=diagnosed_as(""),
    params:
        settings=diagnosed,
        own_effects=own_effects_digests(),
        code=code("diagnose", GAP_FIGURES),
    script:
        "../../scripts/diagnose.py"


# the corrected file of a robot that was given as a file
use rule diagnose as diagnose_mjcf with:
    output:
        **named([*GAP_TABLES, "gap_points", "corrected_drives"], part),
        **drawn(GAP_FIGURES, "figures/{campaign}"),
        verdict=verdict(),
        corrected=f"{RESULTS}/campaigns/{{campaign}}/corrected.xml",
    wildcard_constraints:
        campaign=diagnosed_as("xml"),


use rule diagnose as diagnose_urdf with:
    output:
        **named([*GAP_TABLES, "gap_points", "corrected_drives"], part),
        **drawn(GAP_FIGURES, "figures/{campaign}"),
        verdict=verdict(),
        corrected=f"{RESULTS}/campaigns/{{campaign}}/corrected.urdf",
    wildcard_constraints:
        campaign=diagnosed_as("urdf"),


use rule gather as gather_gap with:
    input:
        **{name: [part(name, campaign) for campaign in DIAGNOSED] for name in GAP_TABLES},
    output:
        **named(GAP_TABLES),
    log:
        f"{RESULTS}/logs/gather_gap.log",


rule gap:
    input:
        named(GAP_TABLES).values(),
        [f"{RESULTS}/figures/{campaign}/gap.png" for campaign in DIAGNOSED],
        [verdict(campaign) for campaign in DIAGNOSED],


TARGETS += rules.gap.input
