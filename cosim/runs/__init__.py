"""The one engine of runs: jobs, where they are done, and the journal that outlives them.

A study makes jobs and reduces what they leave; all else stands here::

    jobs = [Run(scenario, {"seed": seed}, take=errors) for seed in range(20)]
    with make_executor(workers=2) as executor:
        for done in run_jobs(jobs, executor, Journal(folder, resume=True), progress=report):
            if done.failure is None:
                table.append(done.row)

- A **job** (`cosim.runs.job.Job`) has a `key`, the digest of all that its row follows from, and a method `do`. `Run`
  (`cosim.runs.run`) is that of a scenario: settings, and what is taken of the outcome by `take`, a function of a
  module. Other jobs (an FMU alone, members of a batch) are classes of their own.
- An **executor** (`cosim.runs.executors.make_executor`) does jobs in this process, in worker processes
  (``workers=2``) or on a cluster of `dask.distributed` (``scheduler="tcp://host:8786"``), and hands each over as it
  ends. What a job gives does not depend on where it is done, nor on the order. A failure is a value (`Failure`) and
  ends nothing else; ``apart=True`` keeps a single worker in a process of its own, which is replaced when it dies:
  `Run.apart` says whether a scenario has native code of others, or a limit of calls, that may take the process along.
- The **journal** (`cosim.runs.journal.Journal`, ``runs.jsonl``) gets a line for each job as soon as it is done. With
  ``resume`` jobs whose key stands in it are not done again, except for those that failed for a reason outside of them:
  interrupted, ended from outside, no memory left. ``retry`` does all again that failed.
- `cosim.runs.engine.run_jobs` joins the three. `reduce` makes of what a job gave the plain data that the journal keeps,
  in this process (users' functions, files). A job that failed for a reason outside is tried once more before its
  failure stands. Who interrupts one job interrupts the study; what is done by then is in the journal.
"""
