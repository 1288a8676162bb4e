"""The part of a diagnosis page about what no effect of the catalogue explains."""

from __future__ import annotations

from unmodeled.pipeline.diagnosis.remainder_model import RemainderModel
from unmodeled.reports.figures.comparison_force import force_along_orbit
from unmodeled.reports.numbers import number
from unmodeled.reports.sections import Drawn, Section
from unmodeled.reports.tables import Table

__all__ = ["remainder_section"]


def remainder_section(rest: RemainderModel | None) -> Section:
    """Return figure and tables; empty without a remainder."""
    name, title = "remainder", "What no effect of the catalogue explains"
    if rest is None:
        return Section(name, title)
    figure = force_along_orbit(rest.force, rest.learned_curve)
    drawn: tuple[Drawn, ...] = ()
    if figure is not None:
        drawn = (
            Drawn(
                "remainder-acceleration",
                figure,
                "Reconstructed acceleration on the radial, transverse and normal axis with its "
                "band, and the learned one",
                "The acceleration that the residuals ask for beside what was found, whatever its "
                "cause, with two sigmas (what the initial state absorbs is in the band), and "
                "the learned model of it at the same places.",
            ),
        )
    return Section(name, title, (rest.sentence,), drawn, (_model_table(rest), _input_table(rest)))


def _model_table(rest: RemainderModel) -> Table:
    rows = [
        (f"left-out stretches, {s.name}", _skill(s.skill, s.skill_error), "–", "–")
        for s in rest.learners
    ]
    if rest.model is not None:
        before, after = number(rest.rms_before, 3), number(rest.rms_after, 3)
        rows.append((f"fitted arcs, {rest.learners[0].name}", "fitted", before, after))
    there, error = rest.held_out_skill, rest.held_out_skill_error
    if there is not None and error is not None:
        rows.append(
            (
                f"held-out arcs, {rest.learners[0].name}",
                _skill(there, error),
                number(rest.held_out_rms_before or 0.0, 3),
                number(rest.held_out_rms_after or 0.0, 3),
            )
        )
    return Table(
        "The learned model",
        ("where", "share explained [–]", "RMS without [σ]", "RMS with [σ]"),
        tuple(rows),
        note="Share of the sum of squares that is explained, with its standard error; 0 is no "
        "skill. Noise allows "
        f"{number(rest.dependence.possible_skill, 3)} on left-out stretches. RMS with the learned "
        "acceleration in the orbit, states adjusted, one linear step.",
        learners=False,
    )


def _input_table(rest: RemainderModel) -> Table:
    axes = {"inertial": "inertial", "body": "body-fixed", "sun": "Sun", "rtn": "R, T, N"}
    return Table(
        "On what it depends",
        ("inputs", "axes of the force", "ln Bayes factor [–]", "share explained [–]"),
        tuple(
            (
                o.inputs.title,
                axes[o.inputs.axes],
                number(o.log_bayes, 4),
                _skill(o.skill, o.skill_error),
            )
            for o in rest.dependence.options
        ),
        note="A smooth function of these inputs against no force, and the share of stretches that "
        "it predicts when they are left out. The first is chosen; within 3 of the largest factor "
        "these data cannot tell.",
        text_columns=(1,),
        learners=False,
    )


def _skill(value: float, error: float) -> str:
    return f"{value:.3f} ± {error:.3f}" if abs(value) < 10 else f"{value:.0f} ± {error:.0f}"
