// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// The adversity suite: recordings as people have them, made from simulated and shared recordings.
// Each must come out right, or be refused or doubtful with the cause that was put in.
#include "changes.h"
#include "judge.h"
#include "known_faults.h"
#include "program.h"

#include <boost/algorithm/string/replace.hpp>
#include <boost/program_options.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <mutex>
#include <optional>
#include <thread>

namespace {

using namespace adversity;
namespace po = boost::program_options;

/** Exit code that CTest counts as skipped. */
constexpr int SKIPPED = 77;

/** An input with one of its bases. */
struct Case {
  Input input;
  std::string kind, base;

  std::string
  name() const
  {
    return input.name + "." + base;
  }
};

struct Arguments {
  std::vector<std::string> only;
  std::string output; ///< folder that stays; empty: a temporary one
  bool is_fast = false, keep = false;
  int jobs = 2;
};

std::vector<Case>
allCases()
{
  std::vector<Case> cases;
  for (const auto& [kind, inputs] :
       {std::make_pair("pairing", pairingInputs()), std::make_pair("time_stamps", stampInputs()),
        std::make_pair("files", fileInputs()), std::make_pair("color_and_depth", togetherInputs()),
        std::make_pair("units", unitInputs()), std::make_pair("intrinsics", cameraInputs()),
        std::make_pair("scene", sceneInputs())})
    for (const Input& input : inputs)
      for (const std::string& base : input.bases)
        cases.push_back({input, kind, base});
  return cases;
}

/** By kind, by input, or by input and base. */
std::vector<Case>
chosenCases(const Arguments& arguments)
{
  const std::vector<std::string>& only = arguments.only;
  std::vector<Case> chosen;
  for (const Case& c : allCases()) {
    const bool is_named = std::any_of(only.begin(), only.end(), [&c](const std::string& name) {
      return name == c.kind || name == c.input.name || name == c.name();
    });
    const bool is_fast = c.input.is_fast && c.base == c.input.bases.front();
    if ((only.empty() || is_named) && (!arguments.is_fast || is_fast))
      chosen.push_back(c);
  }
  return chosen;
}

/** Runs cases and counts what became of them. */
class Suite {
public:
  Suite(const Arguments& arguments, std::vector<Case> cases)
  : arguments_(arguments), cases_(std::move(cases)),
    output_(arguments.output.empty() ? temporary_.path() : arguments.output)
  {
  }

  /** \return true when each fault is a known one, and each known one is a fault. */
  bool
  run()
  {
    std::printf("%-42s %-15s %4s %-8s %8s %8s %6s %-12s\n", "input", "kind", "exit", "verdict",
                "ATE mm", "limit", "poses", "judgement");
    // Each run has one thread: whole runs in parallel are faster than the parts of one.
    std::atomic<std::size_t> next{0};
    std::vector<std::thread> workers;
    for (int k = 0; k < arguments_.jobs; ++k)
      workers.emplace_back([&] {
        for (std::size_t i = next++; i < cases_.size(); i = next++)
          tryCase(cases_[i]);
      });
    for (std::thread& worker : workers)
      worker.join();
    for (const auto& [name, count] : counts_)
      std::printf("%s: %d\n", name.c_str(), count);
    return is_good_;
  }

private:
  void
  tryCase(const Case& c)
  {
    try {
      runCase(c);
    }
    catch (const std::exception& error) {
      say(c, std::string("FAILED: ") + error.what());
      is_good_ = false;
    }
  }

  void
  runCase(const Case& c)
  {
    Recording recording = baseRecording(c.base);
    if (recording.color.empty()) {
      say(c, "skipped: the shared recording is absent");
      return;
    }
    const double limit = largestError(errorOf(referenceOf(c.base), c.input.reference_step));
    c.input.spoil(recording);
    const std::string folder = output_ + "/" + c.name();
    boost::filesystem::remove_all(folder);
    const Places places = write(recording, folder + "/in");
    const Outcome outcome =
        reconstruct(folder + "/in", folder + "/out", places, recording.arguments);
    const Judgement judgement = judge(c.input, outcome, recording.color.size(), limit);
    count(c, judgement);
    print(c, outcome, limit, recording.color.size(), judgement);
    if (!arguments_.keep && judgement != Judgement::SILENT_FAULT)
      boost::filesystem::remove_all(folder);
  }

  /** Error of every `step`-th frame of the unspoiled recording [m], measured once. */
  double
  errorOf(const std::string& base, std::size_t step)
  {
    const std::lock_guard<std::mutex> lock(reference_mutex_);
    const std::string name = base + "_" + std::to_string(step);
    const auto known = references_.find(name);
    if (known != references_.end())
      return known->second;
    const Recording recording = everyNth(baseRecording(base), step);
    const std::string folder = output_ + "/reference." + name;
    boost::filesystem::remove_all(folder);
    const Places places = write(recording, folder + "/in");
    const Outcome outcome = reconstruct(folder + "/in", folder + "/out", places, {});
    boost::filesystem::remove_all(folder);
    if (!outcome.error)
      throw std::runtime_error("the unspoiled recording " + name + " has no poses");
    return references_[name] = *outcome.error;
  }

  void
  count(const Case& c, Judgement judgement)
  {
    const std::lock_guard<std::mutex> lock(print_mutex_);
    const bool is_fault = judgement != Judgement::RIGHT && judgement != Judgement::NAMED;
    const auto known = knownFaults().find(c.name());
    const bool is_known = known != knownFaults().end();
    if (is_fault != is_known)
      is_good_ = false;
    ++counts_[toString(judgement)];
    if (is_fault && is_known)
      std::printf("%s is a known fault: %s\n", c.name().c_str(), known->second.c_str());
    else if (is_known)
      std::printf("%s is a known fault, but none any longer\n", c.name().c_str());
  }

  /** A row of the table, and what the program said where this is not what was hoped for. */
  void
  print(const Case& c, const Outcome& outcome, double limit, std::size_t num_colors,
        Judgement judgement)
  {
    const std::lock_guard<std::mutex> lock(print_mutex_);
    const double error = outcome.error ? 1e3 * *outcome.error : NAN;
    std::printf("%-42s %-15s %4d %-8s %8.1f %8.1f %3zu/%-3zu %s\n", c.name().c_str(),
                c.kind.c_str(), outcome.exit_code,
                outcome.verdict.empty() ? "-" : outcome.verdict.c_str(), error, 1e3 * limit,
                outcome.num_poses, num_colors, toString(judgement));
    if (judgement != Judgement::RIGHT && !outcome.messages.empty())
      std::printf("    %s\n", shortened(outcome.messages).c_str());
    std::fflush(stdout);
  }

  void
  say(const Case& c, const std::string& text)
  {
    const std::lock_guard<std::mutex> lock(print_mutex_);
    ++counts_[text.substr(0, text.find(':'))];
    std::printf("%-42s %-15s %s\n", c.name().c_str(), c.kind.c_str(), text.c_str());
    std::fflush(stdout);
  }

  /** Beginning and end: that of a refusal says why. */
  static std::string
  shortened(std::string text)
  {
    constexpr std::size_t longest = 600;
    if (text.size() > longest)
      text = text.substr(0, longest / 2) + " ... " + text.substr(text.size() - longest / 2);
    while (!text.empty() && text.back() == '\n')
      text.pop_back();
    return boost::replace_all_copy(text, "\n", "\n    ");
  }

  const Arguments arguments_;
  const std::vector<Case> cases_;
  TemporaryFolder temporary_;
  const std::string output_;
  std::map<std::string, double> references_;
  std::map<std::string, int> counts_;
  std::mutex reference_mutex_, print_mutex_;
  std::atomic<bool> is_good_{true};
};

/** \return nothing when the user asked for help. */
std::optional<Arguments>
parse(int argc, char** argv)
{
  Arguments arguments;
  po::options_description visible, all;
  auto add = visible.add_options();
  add("help,h", "print this text");
  add("output,o", po::value(&arguments.output)->value_name("OUT"),
      "folder for inputs and results; those of silent faults stay there");
  add("keep", po::bool_switch(&arguments.keep), "all inputs and results stay in OUT");
  add("fast", po::bool_switch(&arguments.is_fast), "some inputs of each kind");
  add("jobs", po::value(&arguments.jobs)->value_name("N")->default_value(2),
      "inputs at a time, each with one thread");
  all.add(visible).add_options()("only", po::value(&arguments.only));
  po::positional_options_description positional;
  positional.add("only", -1);
  po::variables_map values;
  po::store(po::command_line_parser(argc, argv).options(all).positional(positional).run(), values);
  po::notify(values);
  if (arguments.jobs < 1)
    throw po::error("--jobs must be at least 1");
  if (arguments.keep && arguments.output.empty())
    throw po::error("--keep needs a folder: -o OUT");
  if (values.count("help")) {
    std::cout << "Usage: bundle_icp_adversity [NAME|KIND...] [options]\n\n" << visible;
    return std::nullopt;
  }
  return arguments;
}

int
runSuite(const Arguments& arguments)
{
  if (!hasProgram("bundle_icp_reconstruct")) {
    std::cerr << "bundle_icp_reconstruct is not built: skipped\n";
    return SKIPPED;
  }
  const std::vector<Case> cases = chosenCases(arguments);
  if (cases.empty()) {
    std::cerr << "no input has one of these names\n";
    return 2;
  }
  return Suite(arguments, cases).run() ? 0 : 1;
}

} // namespace

int
main(int argc, char** argv)
{
  try {
    const std::optional<Arguments> arguments = parse(argc, argv);
    return arguments ? runSuite(*arguments) : 0;
  }
  catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 2;
  }
}
