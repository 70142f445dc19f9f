// The command line: every flag, its help, and the mapping of errors to exit statuses.
#include <cstdio>
#include <cstdlib>
#include <functional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "harness/cli/commands.h"
#include "harness/error.h"
#include "harness/mutate/operators.h"

namespace {

using namespace gnomon;

constexpr const char* kExit =
    "Exit status: 0 all good; 1 a kernel, a frame or a baseline is wrong; 2 usage or bad input "
    "file; 3 no usable device.";

constexpr const char* kJobs =
    "Worker processes at a time (default: one a core, at most 8: a case mostly uses one, and half "
    "a GiB)";

/// "S/E=FILE", repeatable.
void addKernelOption(CLI::App& command, SessionOptions& session) {
  command
      .add_option_function<std::vector<std::string>>(
          "--kernel",
          [&session](const std::vector<std::string>& pairs) {
            for (const std::string& pair : pairs) {
              const std::size_t equals = pair.find('=');
              if (equals == std::string::npos || equals == 0 || equals + 1 == pair.size())
                throw UsageError(fmt::format("--kernel {}: give STAGE/ENTRY=FILE", pair));
              session.kernels[pair.substr(0, equals)] = pair.substr(equals + 1);
            }
          },
          "Judge FILE (GLSL, HLSL, SPIR-V or a JSON adapter) in place of the project's kernel")
      ->type_name("STAGE/ENTRY=FILE")
      ->take_all();
}

/// The flags of every command that runs kernels.
void addSessionOptions(CLI::App& command, SessionOptions& session, std::string& json) {
  command.add_option("--device", session.device,
                     "Part of a device's name, or its index (default: a real GPU, else software)");
  addKernelOption(command, session);
  command.add_option("--seed", session.seed, "Seed of all generated input")->capture_default_str();
  command
      .add_option_function<unsigned>(
          "--timeout", [&session](unsigned s) { session.timeout = std::chrono::seconds(s); },
          "Seconds that a case may take, or one wait for the device (default: 60)")
      ->check(CLI::PositiveNumber);
  command.add_option("--json", json, "Write results as JSON to FILE, or - for standard output")
      ->type_name("FILE");
}

void addShard(CLI::App& command, Selection& selection) {
  command
      .add_option_function<std::string>(
          "--shard",
          [&selection](const std::string& text) {
            unsigned part = 0, parts = 0;
            int used = 0;
            if (std::sscanf(text.c_str(), "%u/%u%n", &part, &parts, &used) != 2 ||
                static_cast<std::size_t>(used) != text.size() || part < 1 || part > parts)
              throw UsageError(
                  fmt::format("--shard {}: give I/N with 1 <= I <= N, such as 2/4", text));
            selection.shard = part;
            selection.shards = parts;
          },
          "Run the I-th of N parts")
      ->type_name("I/N");
}

std::string operatorsHelp() {
  std::string text = "Only these operators, with commas between:";
  for (const OperatorInfo& o : mutationOperators())
    text += fmt::format(" {} ({});", o.name, o.summary);
  text.back() = '.';
  return text;
}

/// What the parsed command line will do.
using Action = std::function<int()>;

void addDevices(CLI::App& app, Action& action) {
  CLI::App* command =
      app.add_subcommand("devices", "Vulkan devices, and which stages each cannot run and why");
  auto options = std::make_shared<DevicesOptions>();
  command->add_option("--json", options->json, "Write as JSON to FILE, or -")->type_name("FILE");
  command->callback([&action, options] { action = [options] { return devices(*options); }; });
}

void addList(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("list", "Stages, kernels or cases");
  auto options = std::make_shared<ListOptions>();
  command->add_option("what", options->what, "stages, kernels or cases")
      ->required()
      ->check(CLI::IsMember({"stages", "kernels", "cases"}));
  command->add_option("stages", options->stages, "STAGE or STAGE/ENTRY (default: all)");
  command->add_option("--kind", options->kinds, "Only cases of these kinds, with commas between")
      ->check(CLI::IsMember({"comparison", "law", "truth", "composition", "bound"}))
      ->delimiter(',')
      ->type_name("LIST");
  CLI::Option* kills =
      command->add_flag("--kills", options->kills,
                        "Of cases: how many mutants each kills, and how many no other of its kind "
                        "does; what an earlier run has not found out is run. The flags below are "
                        "for that");
  command
      ->add_option("--mutants", options->mutants,
                   "Only these mutants, by the ids that `mutate` prints, with commas between")
      ->delimiter(',')
      ->type_name("LIST")
      ->needs(kills);
  command->add_option("--jobs", options->jobs, kJobs)
      ->check(CLI::PositiveNumber)
      ->type_name("N")
      ->needs(kills);
  addSessionOptions(*command, options->session, options->json);
  command->callback([&action, options] { action = [options] { return list(*options); }; });
}

void addValidate(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "validate", "Judge every kernel, or those of the stages named, against its model");
  auto o = std::make_shared<ValidateOptions>();
  command->add_option("stages", o->selection.stages, "STAGE or STAGE/ENTRY (default: all)");
  command
      ->add_option_function<std::size_t>(
          "--cases", [o](std::size_t n) { o->session.cases = n; },
          "Generated inputs of each case (default: tests/policy.json)")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--filter", o->selection.filter,
                   "Only cases whose name (see `list cases`) matches the shell pattern")
      ->type_name("GLOB");
  command
      ->add_option("--out", o->out,
                   "Write what each case found into DIR, as it comes; after a run that was killed "
                   "the same command goes on where it was")
      ->type_name("DIR");
  command
      ->add_option("--replay", o->session.replay,
                   "Judge one input again: a file that a failure was shrunk to (DIR/failures of "
                   "--out, else in the user's cache), as its `reproduce:` line says")
      ->type_name("FILE");
  command->add_flag_callback(
      "--no-shrink", [o] { o->session.shrinks = false; },
      "Show a failing input as it was generated, and write none: saves seconds for each failure");
  command->add_option("--junit", o->junit, "Write JUnit XML to FILE")->type_name("FILE");
  addShard(*command, o->selection);
  command->add_option("--jobs", o->jobs, kJobs)->check(CLI::PositiveNumber)->type_name("N");
  command->add_flag("--require", o->require, "Unsupported or skipped cases are failures");
  command->add_flag("--fail-fast", o->failFast, "Stop at the first failure; the rest does not run");
  addSessionOptions(*command, o->session, o->json);
  command->footer(kExit);
  command->callback([&action, o] { action = [o] { return validate(*o); }; });
}

void addMutate(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "mutate", "Change kernels one instruction at a time: do the cases notice?");
  auto o = std::make_shared<MutateOptions>();
  command->add_option("stages", o->stages, "STAGE or STAGE/ENTRY (default: all)");
  command
      ->add_option_function<std::size_t>(
          "--sample", [o](std::size_t n) { o->sample = n; },
          "Only N mutants of each kernel, chosen by --seed")
      ->check(CLI::PositiveNumber)
      ->type_name("N");
  command->add_option("--operators", o->operators, operatorsHelp())
      ->delimiter(',')
      ->type_name("LIST");
  command->add_option("--jobs", o->jobs, kJobs)->check(CLI::PositiveNumber)->type_name("N");
  command->add_flag("--bless", o->bless,
                    "Write the scores into tests/mutants/ and README.md's table of stages");
  addSessionOptions(*command, o->session, o->json);
  command->footer(
      "Exit status: 0 all good; 1 a survivor is not explained, a score is below the policy or not "
      "the one on record; 2 usage or bad input file; 3 no usable device.");
  command->callback([&action, o] { action = [o] { return mutate(*o); }; });
}

void addBench(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("bench", "GPU time of kernels, and how it scales");
  auto o = std::make_shared<BenchOptions>();
  command->add_option(
      "stages", o->stages,
      "STAGE or STAGE/ENTRY, or objects: culling of 100 to 1,000,000 objects in two worlds, "
      "beside the CPU, and the law of its growth (default: all)");
  command
      ->add_option_function<std::size_t>(
          "--to", [o](std::size_t n) { o->most = n; },
          "The largest number of objects (default: 1,000,000)")
      ->check(CLI::Range(std::size_t{100}, std::size_t{10'000'000}))
      ->type_name("N");
  command->add_option("--plot", o->plot, "Draw time by number of objects as SVG")
      ->type_name("FILE");
  command
      ->add_option("--baseline", o->baseline,
                   "Compare with an earlier --json; exit 1 where slower than the policy allows")
      ->check(CLI::ExistingFile)
      ->type_name("FILE");
  command->add_option("--jobs", o->jobs, "Taken for scripts; benchmarks run one at a time")
      ->check(CLI::PositiveNumber)
      ->type_name("N");
  addSessionOptions(*command, o->session, o->json);
  command->footer(kExit);
  command->callback([&action, o] { action = [o] { return bench(*o); }; });
}

void addCompare(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "compare", "Two OpenEXR images: largest error, RMSE, worst block, PSNR, FLIP");
  auto o = std::make_shared<CompareOptions>();
  command->add_option("A", o->reference, "The reference")->required()->type_name("A.exr");
  command->add_option("B", o->test, "What is judged")->required()->type_name("B.exr");
  command->add_option("--heatmap", o->heatmap, "Write FLIP's error map as PNG")->type_name("FILE");
  command->add_option("--max", o->max, "Exit 1 where the largest error is above X")
      ->check(CLI::NonNegativeNumber)
      ->type_name("X");
  command->add_option("--flip", o->flip, "Exit 1 where FLIP's mean is above X")
      ->check(CLI::NonNegativeNumber)
      ->type_name("X");
  command->add_option("--json", o->json, "Write as JSON to FILE, or -")->type_name("FILE");
  command->footer(kExit);
  command->callback([&action, o] { action = [o] { return compare(*o); }; });
}

void addTest(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("test", "Every test of the project, through ctest");
  auto arguments = std::make_shared<std::vector<std::string>>();
  command->add_option("arguments", *arguments, "Passed to ctest, after --");
  command->callback([&action, arguments] { action = [arguments] { return test(*arguments); }; });
}

/// Hidden: what the command starts itself with.
void addWorker(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand("worker", "")->group("");
  auto task = std::make_shared<std::string>();
  command->add_option("task", *task)->required();
  command->callback([&action, task] { action = [task] { return worker(*task); }; });
}

int complain(const char* what, int status) {
  fmt::print(stderr, "gnomon: {}\n", what);
  return status;
}

int run(int argc, char** argv) {
  CLI::App app("Says whether a GPU rendering algorithm is right.", "gnomon");
  app.set_version_flag("--version", GNOMON_VERSION);
  app.require_subcommand(0, 1);  // required, but an unknown word is the better complaint
  app.footer(kExit);
  Action action;
  addDevices(app, action);
  addList(app, action);
  addValidate(app, action);
  addMutate(app, action);
  addBench(app, action);
  addCompare(app, action);
  addTest(app, action);
  addWorker(app, action);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::CallForVersion& version) {
    return app.exit(version);
  } catch (const CLI::ParseError& error) {
    return complain(fmt::format("{}\nSee `gnomon --help`.", error.what()).c_str(), kUsage);
  }
  if (!action) throw UsageError("which command? See `gnomon --help`.");
  return action();
}

}  // namespace

int main(int argc, char** argv) {
  // GoogleTest's own sharding would drop cases behind the runner's back; --shard does not.
  unsetenv("GTEST_TOTAL_SHARDS");
  unsetenv("GTEST_SHARD_INDEX");
  testing::InitGoogleTest();
  try {
    return run(argc, argv);
  } catch (const UsageError& error) {
    return complain(error.what(), kUsage);
  } catch (const DeviceError& error) {
    return complain(error.what(), kNoDevice);
  } catch (const std::exception& error) {
    return complain(error.what(), kWrong);
  }
}
