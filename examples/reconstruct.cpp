// SPDX-License-Identifier: BSD-3-Clause
// SPDX-FileCopyrightText: 2026 the bundle_icp authors
//
// From a recording to poses, a sparse model and a mesh.
#include <bundle_icp/reconstruction.h>
#include <cstdio>
#include <cstdlib>
using namespace bundle_icp;
int main(int argc, char** argv)
{
  auto env=[](const char*n,double d){const char*v=getenv(n);return v?atof(v):d;};
  DatasetOptions d; d.stride=argc>3?atoi(argv[3]):1; if(getenv("SHUF")) d.shuffle_seed=atoi(getenv("SHUF"));
  d.undistort_depth=env("UNDIST",1)>0;
  auto ds=openDataset(argv[1],d);
  ReconstructionOptions o; o.make_mesh=getenv("MESH")!=nullptr;
  o.mapper.num_dense_neighbours=env("DN",4); o.num_threads=env("NT",0); o.mapper.dense_weight=env("DW",0.1);
  o.features.max_features=env("NF",o.features.max_features); o.graph.key_similarity=env("KS",o.graph.key_similarity);
  o.graph.exhaustive_limit=env("EX",300);
  auto r=reconstruct(*ds,o,[](const Progress&){return true;});
  writeReconstruction(argv[2],*ds,o,r);
  int reg=0,keys=0; for(auto&f:r.frames){ reg+=f.registered; if(!f.registered) fprintf(stderr,"%s: %s\n",f.name.c_str(),f.reason.c_str()); }
  for(size_t i=0;i<r.graph->size();i++) keys+=r.graph->isKey(i);
  printf("%d of %zu, keys %d, edges %zu, comps %zu\n",reg,r.frames.size(),keys,r.graph->numEdges(),r.component_sizes.size());
  for(auto&[n,s]:r.timing_s) printf("%s %.1f  ",n.c_str(),s);
  printf(" peak %.2f GB\n",r.peak_memory_bytes/1e9);
}
