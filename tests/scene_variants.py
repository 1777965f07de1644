"""Variants of scenes whose parts share facts, such as posture, payload and stiffness."""

VARIANTS = [
    ("sdelta_hfsa", {"law": "pd", "gravity": "9.81"}),
    ("sdelta_hfsa", {"law": "pd", "feed_forward": "rigid"}),
    ("sdelta_hfsa", {"law": "ctc", "feedback": "pose"}),
    ("sdelta_hfsa", {"law": "ctc_cartesian", "feed_forward": "elastic", "gravity": "9.81"}),
    ("sdelta_shaker", {}),
    ("sdelta_accelerometer", {}),
    ("sdelta_manoeuvre", {"gravity": "9.81"}),
    ("stage_tracking", {"law": "ctc"}),
    ("stage_tracking", {"law": "pd_ff", "motion": "step", "stack": "hysteretic"}),
    ("stage_tracking", {"law": "integral_ff"}),
    ("stage_tracking", {"law": "ctc", "actuator": "force", "motion": "step"}),
    ("stage_bode", {}),
    ("stage_accelerometer", {"stage": "exact"}),
    ("stage_extremes", {}),
    ("beam_payload", {"suspension": "massless"}),
]
