"""`nrdf ablate`: what each loss of the last training stage is worth (the paper's Table III)."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from tyro.conf import Positional

from nrdf.commands.console import command_line, console, progress_bar, versions
from nrdf.commands.options import Cluster, File, Folder
from nrdf.io.bounds import Count
from nrdf.tasks import chosen_workers

Variant = Literal["complete", "cd", "emd", "ncd", "ds", "dd"]


def ablate(
    category: Positional[str],
    data: tuple[Folder, ...],
    schedule: Literal["short", "full"] = "short",
    config: File | None = None,
    only: tuple[Variant, ...] = ("complete", "cd", "emd", "ncd", "ds", "dd"),
    bsrc: Folder | None = None,
    labels: Literal["published", "corrected"] = "published",
    pairs: Count = 20,
    seeds: Count = 1,
    device: str = "auto",
    workers: Count | None = None,
    cluster: Cluster | None = None,
    out: Folder | None = None,
    overwrite: bool = False,
) -> None:
    """Train without each loss of the last stage, and score (Table III).

    One training for each loss left out, and one with all of them: same seeds, same budget, and the
    stages before the last trained once for all. What these alone are worth is a row as well. Killed
    at any moment, the same command goes on; what is trained is not trained again. Two commands with
    the same folder share the work, one with --only complete cd emd, the other with --only ncd ds
    dd; a last one without --only prints the whole table.

    The score is the mean CD-L1 of the paper's convention, by the paper's eq. 9: on BSRC where its
    folder is given, else on the named regions of parametric shapes that no training set holds.

    Example: nrdf ablate chair --data data/chair data/chair-family --seeds 3 --bsrc bsrc/

    Args:
        category: What the shapes are; chair, car or plane with --bsrc.
        data: Data folders (of `nrdf model prepare` or `nrdf model synth`).
        schedule: short (for a CPU) or full (the paper's, for a GPU); what they cost stands in
            docs/evidence/paper-tables.md.
        config: A configuration file of your own instead; its last stage is the one that loses
            a loss.
        only: The variants to train and score; by the paper's abbreviations, CD (Chamfer
            distance), EMD (earth mover's distance), NCD (normal consistency), DS (descriptor
            smoothness), DD (descriptor distance).
        bsrc: BSRC's folder, with Chair, Car and plane in it.
        labels: BSRC's, as published, or corrected.
        pairs: Pairs of parametric shapes, without --bsrc.
        seeds: Times that each variant's last stage is trained, with different draws; the table
            has their mean and range, and by how much each is above all losses with the same seed.
        device: auto (CUDA where there is one), cpu, cuda or cuda:N.
        workers: Processes that score on BSRC; all cores unless given.
        cluster: Address of a Dask scheduler whose workers do so instead.
        out: Folder of the runs and the table; runs/ablate-CATEGORY unless given.
        overwrite: Train anew what the folder holds of these variants and the shared stages.
    """
    import nrdf
    from nrdf.field.device import choose_device
    from nrdf.training.config import load_config
    from nrdf.training.dataset import load_dataset
    from nrdf.training.provenance import git_commit, list_shapes
    from nrdf_benchmark.ablation import table as ablation_table
    from nrdf_benchmark.ablation import training as ablation
    from nrdf_benchmark.bsrc.dataset import read_bsrc
    from nrdf_benchmark.methods.learned import FieldMethod

    out = out or Path("runs") / f"ablate-{category}"
    settings = load_config(config or ablation.SCHEDULES[schedule])
    chosen, cores = choose_device(device), chosen_workers(workers, cluster)
    # Read before anything is trained: what is wrong with it should not show hours later.
    if bsrc is not None:
        benchmark = read_bsrc(bsrc, category, labels)
        ground = f"BSRC, {benchmark.describe()}"
    else:
        cases = ablation_table.family_cases(category, pairs)
        ground = f"the named regions of {pairs} pairs of parametric shapes, none of them trained on"

    runs = ablation.train_variants(
        only,
        settings,
        data,
        out,
        category=category,
        device=device,
        overwrite=overwrite,
        seeds=seeds,
    )
    entries = list_shapes(data)
    unseen = any(entry.split == "val" for entry in entries)
    dataset = load_dataset(entries, "val", settings.data, chosen) if unseen else None
    results = []
    runs[ablation.SHARED, 0] = out / ablation.SHARED
    for (variant, seed), run in runs.items():
        model = nrdf.load_model(run, str(chosen))
        # What is scored is kept in the run, and a process with other variants may want it too.
        with ablation.turn(out, run.name), progress_bar(ablation.describe(variant)) as progress:
            if bsrc is None:
                regions = ablation_table.score(FieldMethod(model, "points"), cases, progress)
            else:
                regions = ablation_table.benchmark_scores(
                    benchmark, run, str(chosen), cores, lambda _, *counts: progress(*counts)
                )
        validation = ablation_table.validation_losses(model.field, dataset) if dataset else {}
        seconds = 0.0 if variant == ablation.SHARED else ablation.read_cost(run)
        results.append(
            ablation_table.VariantResult(
                variant, regions, validation, seconds, model.metadata, seed
            )
        )
    found = ablation_table.Ablation(
        category,
        schedule if config is None else config.stem,
        ground,
        ablation.read_cost(out / ablation.SHARED),
        results,
    )
    extra = {"command": command_line(), "versions": versions(), "commit": git_commit()}
    found.write(out, {**extra, "seed": settings.seed})
    console.print(found.table())
    console.print(f"\nwrote table3.md, table3.csv and table3.json in {out}")
